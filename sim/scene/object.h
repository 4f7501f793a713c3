#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/result.h"
#include "sim/scene/surface_colour.h"
#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// What stands on the table, in its own frame, mm, +Y its own up.
struct Object {
  std::string name;
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> normals;  ///< unit, one a vertex, for shading
  std::shared_ptr<const SurfaceColour> colour;
};

/// The built-in figurine, or the OBJ, PLY or GLB `file`, scaled to `height_mm`: a file's object so that its two
/// farthest points are that far apart (then the bounding cylinder of every way to put it down is at most 1.155 times as
/// wide), the figurine so that it stands that high. Colour: the file's texture or vertex colours, else stone.
/// Fails with `not_found`, `invalid_input` (not a mesh, no triangles, a coordinate that is not a number),
/// `unsupported`.
Result<Object> load_object(const std::filesystem::path& file, double height_mm);

}  // namespace scanrig::sim
