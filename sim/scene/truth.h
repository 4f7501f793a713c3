#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

/// The exact calibration of a scene's cameras, as docs/scan-folder.md has it. Fails with `io`.
Result<void> write_calibration(const Scene& scene, const std::filesystem::path& file);

/// Where the table really stood while one pose was taken.
struct PoseTruth {
  int placement = 0;               ///< index into Scene::placements()
  std::vector<double> angles_deg;  ///< one a view
};

/// truth.json and truth.ply into a scan folder; `poses` in the order they were taken, at least one. Fails with `io`.
Result<void> write_truth(const Scene& scene, const std::vector<PoseTruth>& poses, const std::filesystem::path& folder);

}  // namespace scanrig::sim
