#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

struct ShootOptions {
  SceneOptions scene;
  int views = 8;  ///< per pose, evenly around the circle
  /// A solved calibration to put into the scan; empty: the scene's own, which is exact but for a lens residual.
  std::filesystem::path calibration{};
  /// The longest and the shortest exposure of the pattern that may be added to a view, as multiples of the first; the
  /// view shows which of them it wants, as at the station. Empty: never more than the first.
  std::vector<double> pattern_factors{};
};

/// Renders a whole scan into the new folder `folder` (docs/reference/scan-folder.md, truth included), without devices
/// or daemon. The small errors of the table come from the profile. The same options give the same bytes. Fails as
/// Scene::create, and with `exists` (the folder has a scan), `out_of_range` (views), `not_found` (calibration), `io`.
Result<void> shoot(const ShootOptions& options, const std::filesystem::path& folder);

}  // namespace scanrig::sim
