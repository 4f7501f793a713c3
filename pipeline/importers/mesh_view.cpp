#include "pipeline/importers/mesh_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/files.h"
#include "pipeline/importers/depth_drawing.h"
#include "pipeline/importers/stanford_files.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {
namespace {

constexpr double kMinFacing = 0.26;         ///< cosine of 75 degrees
constexpr double kMinOneSided = 0.25;       ///< length of the mean normal; a closed surface has 0, half a ball 0.5
constexpr double kMinPixels = 200.0;        ///< along the diagonal of the box around the mesh
constexpr double kMaxPixels = 1000.0;       ///< likewise
constexpr double kFacesPerVertex = 2.0;     ///< of a large triangle mesh
constexpr double kMmOfGridUnit = 1000.0;    ///< range grids are read as metres
constexpr std::size_t kHeaderBytes = 4096;  ///< enough for the elements of a PLY

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Twice the area, along the outward normal.
Eigen::Vector3d doubled_area(const Mesh& mesh, const Mesh::Face& face) {
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>(), c = mesh.vertices[face[2]].cast<double>();
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  if (mesh.normals.size() != mesh.vertices.size()) return normal;
  const Eigen::Vector3f outward = mesh.normals[face[0]] + mesh.normals[face[1]] + mesh.normals[face[2]];
  return normal.dot(outward.cast<double>()) < 0.0 ? Eigen::Vector3d(-normal) : normal;
}

/// Camera axes: z along `ray`, y down where that is possible.
Eigen::Matrix3d camera_looking(const Eigen::Vector3d& ray) {
  const Eigen::Vector3d up =
      std::abs(ray.y()) > 0.9 ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d x = ray.cross(up).normalized();
  Eigen::Matrix3d rows;
  rows << x.transpose(), ray.cross(x).transpose(), ray.transpose();
  return rows;
}

/// The triangles that the camera sees from outside, in its frame, and their projected area.
struct SeenFaces {
  std::vector<Triangle> triangles;
  double area = 0.0;
  Eigen::AlignedBox3d box;
};

SeenFaces seen_faces(const Mesh& mesh, const Eigen::Matrix3d& camera_from_scan) {
  SeenFaces seen;
  for (const Mesh::Face& face : mesh.faces) {
    const Eigen::Vector3d normal = camera_from_scan * doubled_area(mesh, face);
    if (!(-normal.z() > kMinFacing * normal.norm())) continue;
    Triangle& corners = seen.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = camera_from_scan * mesh.vertices[face[k]].cast<double>();
      seen.box.extend(corners[k]);
    }
    seen.area += -0.5 * normal.z();
  }
  return seen;
}

Projection grid_of(const SeenFaces& seen) {
  const double size = seen.box.diagonal().norm();
  const double spacing = std::sqrt(kFacesPerVertex * seen.area / static_cast<double>(seen.triangles.size()));
  const double pixel = std::clamp(spacing, size / kMaxPixels, size / kMinPixels);
  const Eigen::Vector3d low = seen.box.min(), extent = seen.box.sizes();
  return {Projection::Kind::orthographic,
          static_cast<int>(extent.x() / pixel) + 3,
          static_cast<int>(extent.y() / pixel) + 3,
          1.0 / pixel,
          1.0 / pixel,
          1.0 - low.x() / pixel,
          1.0 - low.y() / pixel};
}

bool is_range_grid(std::string_view bytes) {
  if (!bytes.starts_with("ply")) return false;
  const std::string_view header = bytes.substr(0, bytes.find("end_header"));
  return header.size() < kHeaderBytes && header.find("element range_grid") != std::string_view::npos;
}

}  // namespace

Result<ResampledGrid> view_of_mesh(const Mesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0.0;
  for (const Mesh::Face& face : mesh.faces) {
    const Eigen::Vector3d normal = doubled_area(mesh, face);
    sum += normal;
    area += normal.norm();
  }
  if (!(area > 0.0) || !std::isfinite(area)) {
    return fail(ErrorCode::invalid_input, "no face has an area, so there are no normals; export the scan as a surface");
  }
  if (sum.norm() < kMinOneSided * area) {
    return fail(ErrorCode::invalid_input,
                "the faces look to all sides, so this is no single view; export each scan as a mesh of its own");
  }
  ResampledGrid view;
  view.camera_from_scan.linear() = camera_looking(-sum.normalized());
  SeenFaces seen = seen_faces(mesh, view.camera_from_scan.linear());
  if (seen.triangles.empty()) {
    return fail(ErrorCode::invalid_input, "no face looks towards the scanner; export the scan as a surface");
  }
  // Depths near 0 keep their digits.
  view.camera_from_scan.translation() = -seen.box.center();
  for (Triangle& triangle : seen.triangles) {
    for (Eigen::Vector3d& corner : triangle) corner -= seen.box.center();
  }
  seen.box.translate(-Eigen::Vector3d(seen.box.center()));
  view.grid = grid_of(seen);
  view.depth = cv::Mat1f(view.grid.height, view.grid.width, std::numeric_limits<float>::quiet_NaN());
  for (const Triangle& triangle : seen.triangles) draw_triangle(triangle, view.grid, view.depth);
  return view;
}

Result<ResampledGrid> read_view(const std::filesystem::path& file, double unit_mm) {
  const auto bytes = read_file(file);
  if (!bytes) return pass_on(bytes);
  if (is_range_grid(*bytes)) {
    auto grid = read_range_grid(file);
    if (!grid) return pass_on(grid);
    if (unit_mm > 0.0) {
      for (Eigen::Vector3d& p : grid->points) p *= unit_mm / kMmOfGridUnit;
    }
    auto view = resample(*grid);
    if (!view) return pass_on(view, file.string());
    return view;
  }
  auto mesh = read_mesh(file);
  if (!mesh) return pass_on(mesh);
  if (unit_mm > 0.0) {
    for (Eigen::Vector3f& v : mesh->vertices) v *= static_cast<float>(unit_mm);
  }
  auto view = view_of_mesh(*mesh);
  if (!view) return pass_on(view, file.string());
  return view;
}

}  // namespace scanrig
