#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// True placement and true table angles of one pose.
struct TruePose {
  Transform table_from_truth = Transform::Identity();
  std::vector<double> angles_deg;  ///< of the views
};

/// Truth of a simulated scan: truth.json and truth.ply of docs/reference/scan-folder.md.
struct Truth {
  Mesh mesh;  ///< in pose 1's turntable frame
  Camera left;
  Camera right;
  Transform projector_from_turntable = Transform::Identity();
  double table_radius_mm = 0.0;
  std::vector<TruePose> poses;
  std::optional<Transform> pose1_from_pose2;
  std::string object;
  std::string profile_sha256;
};

/// Fails with `not_found`, `io`, `invalid_input` (naming file and key), `unsupported` (version).
Result<Truth> read_truth(const std::filesystem::path& scan_folder);

}  // namespace scanrig
