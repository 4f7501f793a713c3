#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "config/rig_config.h"
#include "core/clock.h"
#include "core/result.h"
#include "daemon/rig/open_devices.h"

namespace scanrig::ctl {

/// Instead of the configuration's.
struct ExposureOptions {
  std::optional<int> exposure_us{};
  std::optional<double> gain{};
};

/// The cameras, and their light, of a rig that no daemon uses.
/// Threads: one owner.
class CameraBench {
 public:
  /// Fails as offline_rig_config() and open_devices(), with `unsupported` (simulated cameras), or with what the cameras
  /// report.
  static Result<std::unique_ptr<CameraBench>> open(const std::filesystem::path& config, const ExposureOptions& options);

  /// `light`: none, pattern or plain. A bad exposure is retaken, as the daemon does.
  Result<StereoFrame> expose(const std::string& light);
  Clock& clock() { return clock_; }
  [[nodiscard]] const config::RigConfig& rig() const { return rig_; }

 private:
  explicit CameraBench(config::RigConfig rig) : rig_(std::move(rig)) {}
  Deadline deadline();
  Result<StereoFrame> expose_once(const std::string& light);

  const config::RigConfig rig_;
  RealClock clock_;
  OpenDevices devices_;
};

}  // namespace scanrig::ctl
