#include "pipeline/evaluate/sigma_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/mesh/solid_properties.h"

namespace scanrig {
namespace {

constexpr double kMinDistance = 20.0, kMaxDistance = 80.0;  // mm, of the pairs
constexpr std::size_t kPartners = 3;                        // of each point

/// One error and its sigma.
struct Claimed {
  double error = 0.0;
  double sigma = 0.0;
};

SigmaClass judged(std::string name, const std::vector<Claimed>& all) {
  SigmaClass found{.name = std::move(name), .count = all.size()};
  if (all.empty()) return found;
  std::vector<double> ratios, errors;
  for (const Claimed& one : all) {
    ratios.push_back(one.error / one.sigma);
    errors.push_back(one.error);
  }
  const auto within = std::ranges::count_if(ratios, [](double r) { return r <= 2.0; });
  found.within_2 = static_cast<double>(within) / static_cast<double>(ratios.size());
  found.ratio = quantile(std::move(ratios), 0.5) / kNormalMedian;
  found.median_mm = quantile(std::move(errors), 0.5);
  return found;
}

/// Smallest radius of curvature along the face's edges; infinite where it is flat.
double radius_at(const Mesh& mesh, const std::vector<Eigen::Vector3f>& normals, std::uint32_t face) {
  double curvature = 0.0;
  const Mesh::Face& f = mesh.faces[face];
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t a = f[k], b = f[(k + 1) % 3];
    const double length = static_cast<double>((mesh.vertices[a] - mesh.vertices[b]).norm());
    const double turn = static_cast<double>((normals[a] - normals[b]).norm());
    if (length > 0.0) curvature = std::max(curvature, turn / length);
  }
  return curvature > 0.0 ? 1.0 / curvature : std::numeric_limits<double>::infinity();
}

}  // namespace

double sigma_at(const Mesh& model, const SurfaceSample& sample) {
  const Mesh::Face& face = model.faces[sample.face];
  const Eigen::Vector3d corners(model.sigma[face[0]], model.sigma[face[1]], model.sigma[face[2]]);
  return sample.weights.dot(corners);
}

SigmaProbe::SigmaProbe(const Mesh& model, const std::vector<SurfaceSample>& samples, const Truth& truth,
                       const SurfaceIndex& surface, const Transform& truth_from_model) {
  if (model.sigma.size() != model.vertices.size() || model.views.size() != model.vertices.size()) return;
  const std::vector<Eigen::Vector3f> normals = vertex_normals(truth.mesh);
  for (const SurfaceSample& sample : samples) {
    Point point;
    point.model = truth_from_model * sample.point;
    const Mesh::Face& face = model.faces[sample.face];
    point.sigma = sigma_at(model, sample);
    if (!(point.sigma > 0.0)) continue;
    point.views = std::min({model.views[face[0]], model.views[face[1]], model.views[face[2]]});
    const auto nearest = surface.nearest(point.model);
    point.truth = nearest.point;
    point.radius = radius_at(truth.mesh, normals, nearest.face);
    point.normal = truth_from_model.linear() * sample.normal;
    points_.push_back(point);
  }
}

void SigmaProbe::see(const TrueView& view) {
  const std::array<Eigen::Vector3d, 2> eyes = {view.left().centre, view.right().centre};
  parallel_for(points_.size(), [&](std::size_t i) {
    Point& point = points_[i];
    double facing = 1.0;
    for (const Eigen::Vector3d& eye : eyes)
      facing = std::min(facing, point.normal.dot((eye - point.truth).normalized()));
    if (facing > point.facing && view.observes(point.truth, point.normal)) point.facing = facing;
  });
}

SigmaClass SigmaProbe::distances() const {
  std::vector<Claimed> all;
  const std::size_t n = points_.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 1; k <= kPartners; ++k) {
      const Point &a = points_[i], &b = points_[(i + k * (n / (kPartners + 1)) + 7 * i) % n];
      const Eigen::Vector3d line = b.truth - a.truth;
      const double length = line.norm();
      if (length < kMinDistance || length > kMaxDistance) continue;
      const Eigen::Vector3d along = line / length;
      const double sigma = std::hypot(a.sigma * a.normal.dot(along), b.sigma * b.normal.dot(along));
      if (sigma > 0.0) all.push_back({std::abs((b.model - a.model).norm() - length), sigma});
    }
  }
  return judged("distances 20 to 80 mm", all);
}

std::vector<SigmaClass> SigmaProbe::figures() const {
  std::vector<SigmaClass> found;
  const auto add = [&](const char* name, const std::function<bool(const Point&)>& belongs) {
    std::vector<Claimed> all;
    for (const Point& p : points_) {
      if (belongs(p)) all.push_back({(p.model - p.truth).norm(), p.sigma});
    }
    found.push_back(judged(name, all));
  };
  const auto incidence = [](const Point& p) { return to_degrees(std::acos(std::clamp(p.facing, -1.0, 1.0))); };
  add("all", [](const Point&) { return true; });
  add("1 view", [](const Point& p) { return p.views == 1; });
  add("2 views", [](const Point& p) { return p.views == 2; });
  add("3 or 4 views", [](const Point& p) { return p.views == 3 || p.views == 4; });
  add("5 views and more", [](const Point& p) { return p.views >= 5; });
  add("incidence under 40 deg", [&](const Point& p) { return p.facing > 0.0 && incidence(p) < 40.0; });
  add("incidence 40 to 55 deg", [&](const Point& p) { return incidence(p) >= 40.0 && incidence(p) < 55.0; });
  add("incidence over 55 deg", [&](const Point& p) { return p.facing > 0.0 && incidence(p) >= 55.0; });
  add("seen by no view of the truth", [](const Point& p) { return p.facing <= 0.0; });
  add("radius under 5 mm", [](const Point& p) { return p.radius < 5.0; });
  add("radius 5 to 20 mm", [](const Point& p) { return p.radius >= 5.0 && p.radius < 20.0; });
  add("radius over 20 mm", [](const Point& p) { return p.radius >= 20.0; });
  found.push_back(distances());
  std::erase_if(found, [](const SigmaClass& one) { return one.count == 0; });
  return found;
}

}  // namespace scanrig
