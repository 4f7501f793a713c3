#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/result.h"
#include "sim/scene/materials.h"
#include "sim/scene/surface_colour.h"
#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// The object on the table, in its own frame, mm, +Y its own up.
struct Object {
  std::string name;
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> normals;  ///< unit, one per vertex, for shading
  std::shared_ptr<const SurfaceColour> colour;
  Materials materials{};
  bool is_upright = false;  ///< has a holder: it is always put down as it is, +Y up
};

/// The built-in figurine, or the OBJ, PLY or GLB `file`, scaled to `height_mm`; or the artefact that `file` names, in
/// its own size. A file's object is scaled so that its two farthest points are that far apart (the bounding cylinder of
/// every placement is then at most 1.155 times as wide), the figurine so that it is that high. Colour: the file's
/// texture or vertex colours, else stone; of artefacts one bright grey.
/// Fails with `not_found`, `invalid_input` (not a mesh, no triangles, a coordinate that is not a number),
/// `unsupported`.
Result<Object> load_object(const std::filesystem::path& file, double height_mm);

}  // namespace scanrig::sim
