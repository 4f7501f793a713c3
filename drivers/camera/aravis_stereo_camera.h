#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/sensor_camera.h"

namespace scanrig {

struct AravisSensorOptions {
  std::string serial;   ///< the camera must have this serial number
  std::string address;  ///< IP address of a GigE camera; empty: looked for by serial number
};

/// Region of the sensor that is read out, pixels.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Two GenICam cameras, GigE Vision or USB3 Vision. Features by their SFNC names.
struct AravisOptions {
  AravisSensorOptions left;
  AravisSensorOptions right;
  std::string trigger_source = "Line0";  ///< an input of both cameras, or "Software"
  bool falling_edge = false;
  /// Outputs of the left camera, each wired to a light of the projector and to the right camera's `trigger_source`. The
  /// left camera is then triggered by software only, see SensorCamera::strobe(). Empty: both cameras have
  /// `trigger_source`.
  std::vector<std::string> strobe_outputs;
  std::string pixel_format = "Mono8";  ///< Mono8..16, BayerRG8 and its like, RGB8, BGR8, YUV422_8; not packed ones
  std::chrono::microseconds exposure{12000};
  /// In the camera's own units; empty: of its user set Default, or the lowest where it has none.
  std::optional<double> gain, black_level;
  std::optional<Region> region;  ///< empty: the whole sensor
  int packet_bytes = 0;          ///< GigE: with IP and UDP headers, at most the MTU; 0: as large as passes
  std::chrono::microseconds packet_delay{0};
  TriggeringOptions::FrameClock frame_clock = TriggeringOptions::FrameClock::interval;
  std::chrono::milliseconds frame_timeout{500};
  std::chrono::seconds idle_refresh{10};
};

/// Two cameras, connected by prepare() or arm(). See open_aravis() for its errors.
std::unique_ptr<SensorCamera> aravis_camera(const AravisOptions& options, Clock& clock);

/// Two cameras, connected and set up. Fails with `not_found` (no such camera), `io`, `timeout`, `invalid_input`
/// (another serial number, a feature that rejects the value, packets larger than the network passes),
/// `unsupported` (no trigger, no such pixel format, no such output or an output that cannot follow the exposure).
Result<std::unique_ptr<SensorCamera>> open_aravis(const AravisOptions& options, Clock& clock, Deadline deadline);

enum class CameraBus { gige, usb3 };

/// Setting of this machine that would lose frames of `frame_bytes` although the cameras work: a sentence with the
/// remedy, or nothing. Checks socket buffers for GigE, usbfs memory for USB3, in /proc and /sys below `root`. An error
/// about a torn frame includes the sentence.
std::optional<std::string> host_finding(CameraBus bus, std::size_t frame_bytes, const std::string& root = "");

}  // namespace scanrig
