#pragma once

#include <optional>
#include <string_view>

#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// Calibrated bodies of acceptance tests [VDI/VDE 2634 parts 2 and 3], exact to 1 um. mm, each standing on y = 0 by a
/// holder of its own. Corners have vertices of their own, so that they are shaded as corners.
/// To add an artefact: its sizes here, its name and mesh in artefacts.cpp, its test.
struct Artefacts {
  static constexpr double kSphereMm = 25.0;    ///< diameter, of `sphere` and of both balls of `ball-bar`
  static constexpr double kBallBarMm = 100.0;  ///< between the centres of its balls
  static constexpr double kPlaneWidthMm = 90.0, kPlaneHeightMm = 80.0;  ///< of the face of `plane`
  static constexpr double kStepHeightsMm[] = {20.0, 30.0, 35.0};        ///< of `step-gauge`, over its lowest step
};

/// The artefact `name`: sphere, ball-bar, plane or step-gauge; nothing for another name.
std::optional<TriangleMesh> artefact(std::string_view name);

}  // namespace scanrig::sim
