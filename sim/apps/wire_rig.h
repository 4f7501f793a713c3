#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/apps/rig_cameras.h"
#include "sim/apps/rig_panel.h"
#include "sim/apps/rig_toml.h"
#include "sim/wire/axis.h"
#include "sim/wire/line_settings.h"
#include "sim/wire/simulated_drive.h"
#include "sim/wire/wire_server.h"

namespace scanrig::sim {

struct WireRigOptions {
  RigTomlOptions toml;       ///< content of rig.toml: folder, drive, panel, gear
  wire::AxisOptions axis;    ///< of the simulated mechanics
  bool positive_ccw = true;  ///< direction of the table for positive pulses, seen from above
  std::optional<std::int32_t> preload_counter;
  std::optional<SceneOptions> scene;  ///< scene of two GigE cameras; nothing: no cameras
  bool numbered_frames = false;       ///< see RigCamerasOptions, as the next
  int max_exposure_us = 0;            ///< of the cameras; 0: any
  std::optional<std::uint64_t> camera_state;
};

/// True state of the mechanics.
struct RigTruth {
  double angle_deg = 0;  ///< of the table, counter-clockwise from the home switch, turns counted
  double speed_deg_s = 0;
  bool stopped = true;
  bool projector_on = false;  ///< pattern or plain light
  std::int32_t counter = 0;   ///< the drive's, pulses
  bool powered = true;        ///< the drive has power: the e-stop is released
};

/// The simulated rig on the wire: drive, panel and projector behind their ports in one folder, cameras on the loopback,
/// and rig.toml that points at them; with cameras calibration.json beside it. A pressed e-stop takes the drive's power
/// away, as the relay of a real rig does.
/// Threads: every function may be called from any thread.
class WireRig {
 public:
  /// Creates the folder. Fails with `io`, `unsupported` (no such drive or panel), as RigCameras::start.
  static Result<std::unique_ptr<WireRig>> start(const WireRigOptions& options, Clock& clock);
  ~WireRig();

  [[nodiscard]] RigTruth truth() const;
  [[nodiscard]] RigPanel& panel() { return *panel_; }
  [[nodiscard]] RigCameras* cameras() { return cameras_.get(); }  ///< null if there are none
  Result<Clock::TimePoint> press(const std::string& input, bool pressed);
  [[nodiscard]] std::vector<wire::WireFrame> frames() const { return server_->log(); }

  /// For every request from now on, until changed; nothing: no fault.
  void set_fault(std::optional<wire::WireFault> fault);
  Result<void> plug_in(bool plugged);
  void set_estop_cuts_power(bool cuts);
  /// Settings of the drive's own port.
  void set_line(const wire::LineSettings& settings) { server_->set_line(settings); }
  void set_positive_ccw(bool ccw);
  [[nodiscard]] wire::SimulatedDrive& drive() { return *drive_; }

 private:
  explicit WireRig(std::filesystem::path port) : port_(std::move(port)) {}
  /// Puts the drive behind its port.
  Result<void> connect_drive(const WireRigOptions& options, Clock& clock);
  Result<void> start_cameras(const WireRigOptions& options, Clock& clock);
  void apply_fault();

  const std::filesystem::path port_;
  mutable std::mutex mutex_;
  bool positive_ccw_ = true;
  bool estop_cuts_power_ = true;
  bool powered_ = true;
  std::optional<wire::WireFault> fault_;
  std::unique_ptr<wire::SimulatedDrive> drive_;
  std::unique_ptr<wire::WireServer> server_;
  std::unique_ptr<RigPanel> panel_;
  std::unique_ptr<RigCameras> cameras_;
};

}  // namespace scanrig::sim
