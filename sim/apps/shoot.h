#pragma once

#include <filesystem>

#include "core/result.h"
#include "sim/scene/scene.h"

namespace scanrig::sim {

struct ShootOptions {
  SceneOptions scene;
  int views = 8;  ///< a pose, evenly around the circle
};

/// Renders a whole scan into the new folder `folder` (docs/reference/scan-folder.md, truth included), without devices
/// or daemon: the table takes its small errors from the profile. The same options give the same bytes.
/// Fails as Scene::create, and with `exists` (the folder has a scan), `out_of_range` (views), `io`.
Result<void> shoot(const ShootOptions& options, const std::filesystem::path& folder);

}  // namespace scanrig::sim
