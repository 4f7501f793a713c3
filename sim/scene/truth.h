#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

/// The exact calibration of a scene's cameras, as docs/scan-folder.md has it. Fails with `io`.
Result<void> write_calibration(const Scene& scene, const std::filesystem::path& file);

/// truth.json and truth.ply into a scan folder. `angles_deg`: for each pose, where the table really stood at each view.
/// Fails with `io`.
Result<void> write_truth(const Scene& scene, const std::vector<std::vector<double>>& angles_deg,
                         const std::filesystem::path& folder);

}  // namespace scanrig::sim
