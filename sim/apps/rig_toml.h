#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"

namespace scanrig::sim {

/// Content of rig.toml of the simulated rig.
struct RigTomlOptions {
  std::filesystem::path folder;       ///< where rig.toml, the sockets and the ports are
  std::string drive;                  ///< "leadshine-rs", "oriental-az", "grbl"
  std::string panel;                  ///< "gpio", "modbus-io"
  std::string cameras = "simulated";  ///< "gige": those of RigCameras; "simulated": scanrigd-sim renders alone
  bool positive_ccw = true;
  double gear_ratio = 90;
  double pulses_per_motor_rev = 10000;
  double speed_deg_s = 45;
  double acceleration_deg_s2 = 90;
  int views = 8;
  int poses = 2;
  double voxel_mm = 1.0;
};

/// Writes FOLDER/rig.toml for scanrigd and scanrigd-sim, and FOLDER/drives with the profiles. Fails with `io`.
Result<void> write_rig_toml(const RigTomlOptions& options);

}  // namespace scanrig::sim
