#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "pipeline/pose/stable_rests.h"

namespace scanrig {
namespace {

/// Directions of the 320 faces of an icosahedron split twice.
std::vector<Eigen::Vector3d> sphere_faces() {
  using Triangle = std::array<Eigen::Vector3d, 3>;
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  std::vector<Eigen::Vector3d> corners;
  for (const double s : {-1.0, 1.0}) {
    for (const double t : {-g, g}) {
      corners.emplace_back(0, s, t);
      corners.emplace_back(s, t, 0);
      corners.emplace_back(t, 0, s);
    }
  }
  std::vector<Triangle> triangles;  // of corners that are each other's neighbours, at distance 2
  const auto near = [&](std::size_t a, std::size_t b) { return (corners[a] - corners[b]).norm() < 2.1; };
  for (std::size_t a = 0; a < 12; ++a) {
    for (std::size_t b = a + 1; b < 12; ++b) {
      for (std::size_t c = b + 1; c < 12; ++c) {
        if (near(a, b) && near(b, c) && near(a, c)) {
          triangles.push_back({corners[a].normalized(), corners[b].normalized(), corners[c].normalized()});
        }
      }
    }
  }
  for (int split = 0; split < 2; ++split) {
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : triangles) {
      const Eigen::Vector3d ab = (a + b).normalized();
      const Eigen::Vector3d bc = (b + c).normalized();
      const Eigen::Vector3d ca = (c + a).normalized();
      finer.insert(finer.end(), {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  std::vector<Eigen::Vector3d> directions;
  for (const auto& [a, b, c] : triangles) directions.push_back((a + b + c).normalized());
  return directions;
}

std::size_t nearest(const std::vector<Eigen::Vector3d>& directions, const Eigen::Vector3d& normal) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < directions.size(); ++k) {
    if (directions[k].dot(normal) > directions[best].dot(normal)) best = k;
  }
  return best;
}

/// One cell of the Extended Gaussian Image: the surface whose normal falls into it.
struct Cell {
  Eigen::Vector3d area = Eigen::Vector3d::Zero();  ///< sum of the faces' area vectors, mm2
  std::vector<std::uint32_t> faces;
};

std::vector<Cell> gaussian_image(const Mesh& solid) {
  const auto directions = sphere_faces();
  std::vector<std::uint16_t> cell_of(solid.faces.size());
  std::vector<Eigen::Vector3d> area_of(solid.faces.size());
  constexpr std::size_t kBlock = 4096;
  parallel_for((solid.faces.size() + kBlock - 1) / kBlock, [&](std::size_t b) {
    for (std::size_t f = b * kBlock; f < std::min(solid.faces.size(), (b + 1) * kBlock); ++f) {
      const auto& face = solid.faces[f];
      const Eigen::Vector3d a = solid.vertices[face[0]].cast<double>();
      area_of[f] = 0.5 * (solid.vertices[face[1]].cast<double>() - a).cross(solid.vertices[face[2]].cast<double>() - a);
      cell_of[f] = static_cast<std::uint16_t>(nearest(directions, area_of[f]));
    }
  });
  std::vector<Cell> cells(directions.size());
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    cells[cell_of[f]].area += area_of[f];
    cells[cell_of[f]].faces.push_back(static_cast<std::uint32_t>(f));
  }
  return cells;
}

/// The tangent plane of a cell, refined on its own vertices: mean normal, at the farthest of them.
StableRest tangent_plane(const Mesh& solid, const Cell& cell) {
  StableRest plane;
  plane.normal = cell.area.normalized();
  plane.offset_mm = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t f : cell.faces) {
    for (const std::uint32_t v : solid.faces[f]) {
      plane.offset_mm = std::max(plane.offset_mm, plane.normal.dot(solid.vertices[v].cast<double>()));
    }
  }
  return plane;
}

}  // namespace

Result<StableRests> rests_on_sphere(const Mesh& solid, const SolidProperties& properties, double other_height_mm,
                                    const StableRestOptions& options) {
  const auto hull = convex_hull(solid.vertices);
  if (!hull) return pass_on(hull, "stable rests");
  const double dilation = std::max(options.dilation_mm, options.dilation * properties.size_mm);
  StableRests found;
  for (const Cell& cell : gaussian_image(solid)) {
    if (cell.area.norm() < 1e-6 * properties.size_mm * properties.size_mm) continue;
    StableRest plane = tangent_plane(solid, cell);
    ++found.counts.tangent_planes;
    const double reach = reach_along(hull->vertices, plane.normal);
    if (reach > plane.offset_mm + options.support_tolerance_mm) continue;
    ++found.counts.after_base_plane;
    std::vector<Eigen::Vector3d> supports;
    for (const Eigen::Vector3f& v : hull->vertices) {
      const Eigen::Vector3d corner = v.cast<double>();
      if (plane.normal.dot(corner) > reach - options.support_tolerance_mm) supports.push_back(corner);
    }
    plane.offset_mm = reach;
    plane.margin_mm = support_margin(supports, plane.normal, properties.centre_of_mass);
    if (plane.margin_mm < -dilation) continue;
    ++found.counts.after_stability;
    plane.height_mm = reach + reach_along(hull->vertices, -plane.normal);
    if (std::abs(plane.height_mm - other_height_mm) > options.height_tolerance_mm) continue;
    ++found.counts.after_height;
    found.rests.push_back(plane);
  }
  found.rests = distinct(found.rests, 0.0);
  return found;
}

}  // namespace scanrig
