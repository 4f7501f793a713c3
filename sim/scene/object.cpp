#include "sim/scene/object.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>

#include "sim/scene/artefacts.h"
#include "sim/scene/figurine.h"
#include "sim/scene/mesh_file.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

constexpr float kArtefactAlbedo = 0.6F;  // sprayed or ceramic, as the guideline asks: diffuse

Result<MeshFile> read_mesh(const std::filesystem::path& file) {
  std::string kind = file.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return std::tolower(c); });
  if (kind == ".obj") return read_obj(file);
  if (kind == ".ply") return read_ply(file);
  if (kind == ".glb") return read_glb(file);
  return fail(ErrorCode::unsupported,
              "object {}: cannot be read; give an OBJ, PLY or GLB file, sphere, ball-bar, plane or step-gauge",
              file.string());
}

Result<void> check(const TriangleMesh& mesh, const std::filesystem::path& file) {
  if (mesh.triangles.empty()) {
    return fail(ErrorCode::invalid_input, "object {}: the mesh has no faces", file.string());
  }
  const int count = static_cast<int>(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    if (t.minCoeff() < 0 || t.maxCoeff() >= count) {
      return fail(ErrorCode::invalid_input, "object {}: a face names a vertex that does not exist", file.string());
    }
  }
  for (const auto& v : mesh.vertices) {
    if (!v.allFinite()) {
      return fail(ErrorCode::invalid_input, "object {}: a vertex coordinate is not a number", file.string());
    }
  }
  return {};
}

std::shared_ptr<const SurfaceColour> colour_of(MeshFile& file) {
  if (!file.image.empty()) {
    std::vector<double> areas;
    for (const auto& t : file.mesh.triangles) {
      const Vector3d& a = file.mesh.vertices[t[0]];
      areas.push_back(0.5 * (file.mesh.vertices[t[1]] - a).cross(file.mesh.vertices[t[2]] - a).norm());
    }
    return image_colour(file.image, std::move(file.corners), areas);
  }
  if (!file.colours.empty()) return vertex_colour(std::move(file.colours), file.mesh.triangles);
  return stone_colour();
}

}  // namespace

Result<Object> load_object(const std::filesystem::path& file, double height_mm) {
  if (!(height_mm > 0.0)) {
    return fail(ErrorCode::invalid_input, "object: a height of {} mm is not possible", height_mm);
  }
  Object object;
  if (file.empty()) {
    object.name = "figurine";
    object.mesh = figurine();
    for (auto& v : object.mesh.vertices) v *= height_mm / 100.0;
    object.colour = painted_colour();
  } else if (auto calibrated = artefact(file.native())) {
    object.name = file.string();
    object.mesh = std::move(*calibrated);
    object.is_upright = true;
    const std::vector<Eigen::Vector3f> colours(object.mesh.vertices.size(), Eigen::Vector3f::Constant(kArtefactAlbedo));
    object.colour = vertex_colour(colours, object.mesh.triangles);
  } else {
    auto read = read_mesh(file);
    if (!read) return pass_on(read);
    if (const auto good = check(read->mesh, file); !good) return pass_on(good);
    weld(*read);
    const double extent = largest_extent(extreme_vertices(read->mesh.vertices));
    if (read->mesh.triangles.empty() || !(extent > 0.0)) {
      return fail(ErrorCode::invalid_input, "object {}: the mesh has no surface", file.string());
    }
    for (auto& v : read->mesh.vertices) v *= height_mm / extent;
    object.name = file.filename().string();
    object.colour = colour_of(*read);
    object.mesh = std::move(read->mesh);
  }
  object.normals = vertex_normals(object.mesh);
  return object;
}

}  // namespace scanrig::sim
