#pragma once

#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/gige_model.h"

namespace scanrig::sim::wire {

enum class Side { left, right };

/// One trigger edge, as seen by the sensors.
struct GigeExposure {
  std::uint64_t number = 0;  ///< counts the edges since the start, from 1
  bool pattern = false;      ///< the pattern was on
  Clock::TimePoint at;
};

/// Exposures by software without an active output are numbered from here.
inline constexpr std::uint64_t kFirstBySoftware = 0x80000000;

/// Writes a sensor's view into `image` (8 bit, one channel, of the configured size), just before it is sent. Called
/// from the cameras' threads.
using FrameSource = std::function<void(Side side, const GigeExposure& exposure, cv::Mat& image)>;

/// Faults of the frame of an edge.
enum class GigeFault {
  none,
  lost,     ///< exposed, never sent
  missed,   ///< the edge was not detected: the camera does not count it
  late,     ///< sent, long after
  torn,     ///< some of its packets are lost
  stale,    ///< the frame of the edge before is sent again
  dark,     ///< without light
  blurred,  ///< out of focus
  swapped,  ///< the other sensor's image
};

/// By the name of the enumerator; nothing for other names.
std::optional<GigeFault> parse_gige_fault(std::string_view word);

struct GigeCamerasOptions {
  std::string left_address = "127.0.0.1";
  std::string right_address = "127.0.0.2";
  std::string left_serial = "40012345";
  std::string right_serial = "40012346";
  cv::Size size{160, 120};
  std::chrono::milliseconds late_by{150};
  bool is_strobe_wired = true;  ///< the left camera's outputs go to the projector and to the right camera
  GigeModel model;              ///< of both; its sensor is `size`
  /// Exposure for which the source's images are right; others are darker or brighter. 0: exposure has no effect.
  std::chrono::microseconds nominal_exposure{0};
  std::chrono::microseconds frame_after{0};  ///< from the edge to the frame: exposure and readout
  /// Whether a due frame can be read out; empty: always.
  std::function<bool(const GigeExposure& exposure)> ready;
  bool numbered = true;  ///< write the number of the edge into every frame
};

/// Light of a projector on the left camera's outputs: Line1 lights the pattern, Line2 plain light.
struct GigeFlash {
  bool pattern = false;
  Clock::TimePoint at;  ///< start of the exposure
};

/// Share of the frames with each fault, by chance, on one of the two sensors at a time.
struct FaultRates {
  double lost = 0.0, late = 0.0, torn = 0.0, stale = 0.0;
  std::uint64_t seed = 1;
};

/// Number of each fault that occurred by chance.
struct FaultCounts {
  std::uint64_t lost = 0, late = 0, torn = 0, stale = 0;
};

/// Two GigE Vision cameras on the wire, with a line as their trigger input. The left camera's outputs are wired to that
/// input of the right one: when the left camera is triggered by software, an active output exposes both. Stamps are
/// taken from each camera's own clock: neither starts with the other's or with the host's, and they drift apart. A
/// trigger number may be hidden in the upper left corner of every frame, see hidden_number(). All such cameras on a
/// host share one control port: run them in their own network namespace, see loopback.h. Threads: every function may be
/// called from any thread.
class GigeCameras {
 public:
  /// Fails with `io` (the addresses cannot be used, no temporary file).
  static Result<std::unique_ptr<GigeCameras>> start(const GigeCamerasOptions& options, FrameSource source,
                                                    Clock& clock);
  virtual ~GigeCameras() = default;

  /// The edge of the trigger line. Returns its number; a camera that is not waiting for a trigger counts nothing.
  virtual std::uint64_t edge(bool pattern) = 0;
  /// Flashes by the left camera's outputs so far; whether one is lit now.
  [[nodiscard]] virtual std::vector<GigeFlash> flashes() const = 0;
  [[nodiscard]] virtual bool is_lit() const = 0;
  /// Applies the fault to the frames of the next `count` edges, of one sensor.
  virtual void inject(Side side, GigeFault fault, int count) = 0;
  virtual void happen(const FaultRates& rates) = 0;
  [[nodiscard]] virtual FaultCounts happened() const = 0;
  /// Pulls a camera's plug; puts it in again. Fails with `io`.
  virtual Result<void> plug(Side side, bool in) = 0;
  /// Sets a camera's clock forward (or back).
  virtual void set_clock(Side side, std::chrono::nanoseconds by) = 0;
  /// Value of a camera's feature, as in its registers. For tests only.
  [[nodiscard]] virtual std::string value(Side side, const std::string& feature) const = 0;
};

/// Grey texture that changes with every exposure; bright with the pattern, dim without.
void draw_test_image(Side side, const GigeExposure& exposure, cv::Mat& image);

/// Writes a number into the upper left corner, 32 bits of 3x3 pixels each in 4 rows; reads it there. An image smaller
/// than 24x12 pixels holds none. For tests only, not used by drivers.
void hide_number(std::uint32_t number, cv::Mat& image);
std::uint32_t hidden_number(const cv::Mat& image);

}  // namespace scanrig::sim::wire
