#include "pipeline/acceptance/measured_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/statistics.h"
#include "pipeline/acceptance/point_tree.h"
#include "pipeline/mesh/solid_properties.h"

namespace scanrig::acceptance {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Number of the connected set of each vertex for which `is_in` holds, and the area of each set, all of its vertices.
struct Sets {
  std::vector<std::uint32_t> of_vertex;  ///< kNone: `is_in` does not hold
  std::vector<double> area_mm2;
};

template <class IsIn>
Sets connected_sets(const MeasuredSurface& surface, const std::vector<double>& area_mm2, const IsIn& is_in) {
  Sets sets{.of_vertex = std::vector<std::uint32_t>(surface.size(), kNone), .area_mm2 = {}};
  std::vector<std::uint32_t> open;
  for (std::uint32_t seed = 0; seed < surface.size(); ++seed) {
    if (sets.of_vertex[seed] != kNone || !is_in(seed)) continue;
    const auto number = static_cast<std::uint32_t>(sets.area_mm2.size());
    sets.area_mm2.push_back(0.0);
    open.assign(1, seed);
    sets.of_vertex[seed] = number;
    while (!open.empty()) {
      const std::uint32_t at = open.back();
      open.pop_back();
      sets.area_mm2.back() += area_mm2[at];
      for (const std::uint32_t next : surface.neighbours[at]) {
        if (sets.of_vertex[next] != kNone || !is_in(next)) continue;
        sets.of_vertex[next] = number;
        open.push_back(next);
      }
    }
  }
  return sets;
}

/// Those of the points that are farther than `reach` from all of `targets`.
std::vector<std::uint32_t> away_from(const MeasuredSurface& surface, const std::vector<std::uint32_t>& points,
                                     const std::vector<Eigen::Vector3d>& targets, double reach) {
  if (targets.empty()) return points;
  std::vector<std::uint32_t> away;
  const Cloud cloud{targets};
  const PointTree tree(3, cloud);
  for (const std::uint32_t i : points) {
    std::size_t nearest = 0;
    double squared = 0.0;
    tree.knnSearch(surface.points[i].data(), 1, &nearest, &squared);
    if (squared >= reach * reach) away.push_back(i);
  }
  return away;
}

/// One vertex where files of triangles, or of charts, have several at one place; with the attributes of the first.
Mesh welded(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> places;
  Mesh out;
  std::vector<std::uint32_t> new_index;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f& v = mesh.vertices[i];
    const auto [at, is_new] =
        places.emplace(std::array{v.x(), v.y(), v.z()}, static_cast<std::uint32_t>(out.vertices.size()));
    new_index.push_back(at->second);
    if (!is_new) continue;
    out.vertices.push_back(v);
    if (!mesh.views.empty()) out.views.push_back(mesh.views[i]);
    if (!mesh.sigma.empty()) out.sigma.push_back(mesh.sigma[i]);
  }
  for (const auto& f : mesh.faces) out.faces.push_back({new_index[f[0]], new_index[f[1]], new_index[f[2]]});
  return out;
}

}  // namespace

Result<MeasuredSurface> measured_surface(const Mesh& model) {
  const Mesh mesh = welded(model);
  const std::size_t count = mesh.vertices.size();
  MeasuredSurface surface;
  surface.points.reserve(count);
  for (const auto& vertex : mesh.vertices) surface.points.push_back(vertex.cast<double>());
  // From the faces: a file's own normals may be smoothed.
  for (const auto& normal : vertex_normals(mesh)) surface.normals.push_back(normal.cast<double>());
  surface.is_measured.resize(count, true);
  for (std::size_t i = 0; i < mesh.views.size(); ++i) surface.is_measured[i] = mesh.views[i] > 0;
  surface.sigma_mm.resize(count, std::numeric_limits<double>::quiet_NaN());
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < mesh.sigma.size(); ++i) {
    if (!surface.is_measured[i] || !(mesh.sigma[i] > 0.0F)) continue;
    surface.sigma_mm[i] = static_cast<double>(mesh.sigma[i]);
    sigmas.push_back(surface.sigma_mm[i]);
  }
  surface.sigma_median_mm = sigmas.empty() ? 0.0 : quantile(sigmas, 0.5);
  surface.area_mm2.resize(count, 0.0);
  surface.whole_area_mm2.resize(count, 0.0);
  surface.neighbours.resize(count);
  std::vector<double> edges;
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3d &a = surface.points[face[0]], &b = surface.points[face[1]], &c = surface.points[face[2]];
    const double third = (b - a).cross(c - a).norm() / 6.0;
    const bool is_measured = std::ranges::all_of(face, [&](std::uint32_t v) { return surface.is_measured[v]; });
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = face[k], to = face[(k + 1) % 3];
      if (is_measured) surface.area_mm2[from] += third;
      surface.whole_area_mm2[from] += third;
      surface.neighbours[from].push_back(to);
      surface.neighbours[to].push_back(from);
      edges.push_back((surface.points[from] - surface.points[to]).norm());
    }
  }
  if (std::ranges::none_of(surface.area_mm2, [](double area) { return area > 0.0; })) {
    return fail(ErrorCode::degenerate, "nothing of it is measured; name a model of this scanner, or scan again");
  }
  surface.spacing_mm = quantile(std::move(edges), 0.5);
  return surface;
}

Region connected_region(const MeasuredSurface& surface, const IsNear& is_near, double rim_mm) {
  std::vector<bool> near(surface.size());
  for (std::uint32_t i = 0; i < surface.size(); ++i) near[i] = is_near(i);
  const Sets inside = connected_sets(surface, surface.area_mm2, [&](std::uint32_t i) { return near[i]; });
  Region region;
  if (inside.area_mm2.empty()) return region;
  const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(inside.area_mm2) - inside.area_mm2.begin());
  const auto is_of_it = [&](std::uint32_t i) { return inside.of_vertex[i] == largest; };
  // What is not of it, measured or closed. All neighbours of such a set are of the region, or there are none.
  const Sets others = connected_sets(surface, surface.whole_area_mm2, [&](std::uint32_t i) { return !is_of_it(i); });
  std::vector<bool> is_beside(others.area_mm2.size(), false);
  std::vector<Eigen::Vector3d> rim;
  const double small = std::numbers::pi * rim_mm * rim_mm;
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    if (is_of_it(i) || std::ranges::none_of(surface.neighbours[i], is_of_it)) continue;
    is_beside[others.of_vertex[i]] = true;
    if (others.area_mm2[others.of_vertex[i]] > small) rim.push_back(surface.points[i]);
  }
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    const std::uint32_t other = others.of_vertex[i];
    const bool is_enclosed = other != kNone && is_beside[other] && others.area_mm2[other] <= small;
    if (surface.is_measured[i] && (is_of_it(i) || is_enclosed)) all.push_back(i);
  }
  region.points = away_from(surface, all, rim, rim_mm);
  region.at_rim = all.size() - region.points.size();
  for (const std::uint32_t i : region.points) region.area_mm2 += surface.area_mm2[i];
  return region;
}

}  // namespace scanrig::acceptance
