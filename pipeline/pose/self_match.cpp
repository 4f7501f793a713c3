#include "pipeline/pose/self_match.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/mesh/alignment.h"

namespace scanrig {
namespace {

Eigen::Vector3d middle_of(std::span<const SurfaceSample> samples) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SurfaceSample& s : samples) sum += s.point;
  return sum / static_cast<double>(samples.size());
}

/// Half turns about each principal axis; smaller ones about an axis across which the surface spreads alike.
void add_principal_turns(std::span<const SurfaceSample> samples, const Eigen::Vector3d& middle, double alike,
                         std::vector<SelfMatch>& turns) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const SurfaceSample& s : samples) spread += (s.point - middle) * (s.point - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(spread);
  for (int axis = 0; axis < 3; ++axis) {
    turns.push_back({principal.eigenvectors().col(axis), 180.0});
    const double a = principal.eigenvalues()[(axis + 1) % 3], b = principal.eigenvalues()[(axis + 2) % 3];
    if (std::abs(a - b) > alike * std::max(a, b)) continue;
    for (const double fold : {3.0, 4.0, 5.0, 6.0}) turns.push_back({principal.eigenvectors().col(axis), 360.0 / fold});
  }
}

std::vector<SelfMatch> likely_turns(std::span<const SurfaceSample> samples, const Eigen::Vector3d& middle,
                                    double alike) {
  std::vector<SelfMatch> turns;
  for (const double fold : {2.0, 3.0, 4.0, 5.0, 6.0}) turns.push_back({Eigen::Vector3d::UnitY(), 360.0 / fold});
  add_principal_turns(samples, middle, alike, turns);
  return turns;
}

/// Corners and edges of the solid are off by up to half an edge of its mesh.
double half_edge_mm(const Mesh& mesh, std::span<const SurfaceSample> samples) {
  double sum = 0.0;
  for (const SurfaceSample& s : samples) {
    const Mesh::Face& f = mesh.faces[s.face];
    sum += 0.5 * static_cast<double>((mesh.vertices[f[0]] - mesh.vertices[f[1]]).norm());
  }
  return sum / static_cast<double>(samples.size());
}

bool is_measured(const Mesh& mesh, std::uint32_t face) {
  const Mesh::Face& f = mesh.faces[face];
  return mesh.views.empty() || (mesh.views[f[0]] > 0 && mesh.views[f[1]] > 0 && mesh.views[f[2]] > 0);
}

}  // namespace

std::optional<SelfMatch> find_self_match(const Mesh& solid, const SurfaceIndex& surface,
                                         std::span<const SurfaceSample> measured, double size_mm,
                                         const SelfMatchOptions& options) {
  std::vector<SurfaceSample> samples;
  const std::size_t stride = std::max<std::size_t>(1, measured.size() / options.samples);
  for (std::size_t i = 0; i < measured.size(); i += stride) samples.push_back(measured[i]);
  if (samples.size() < 6) return std::nullopt;
  const Eigen::Vector3d middle = middle_of(samples);
  const double tolerance =
      std::max({options.min_tolerance_mm, options.tolerance * size_mm, half_edge_mm(solid, samples)});

  const auto fits = [&](const SelfMatch& turn) {
    const Transform turned = Eigen::Translation3d(middle) * Eigen::AngleAxisd(to_radians(turn.angle_deg), turn.axis) *
                             Eigen::Translation3d(-middle);
    std::vector<SurfaceSample> carried = samples;
    for (SurfaceSample& s : carried) s.point = turned * s.point;
    const Transform aligned = align(carried, solid, surface, {.max_iterations = 6, .max_samples = 150});
    std::size_t known = 0, outside = 0;
    for (const SurfaceSample& s : carried) {
      const Eigen::Vector3d p = aligned * s.point;
      const auto nearest = surface.nearest(p);
      if (is_measured(solid, nearest.face)) ++known;
      const Mesh::Face& f = solid.faces[nearest.face];
      const Eigen::Vector3d a = solid.vertices[f[0]].cast<double>();
      const Eigen::Vector3d up =
          (solid.vertices[f[1]].cast<double>() - a).cross(solid.vertices[f[2]].cast<double>() - a);
      if (nearest.distance > tolerance && up.dot(p - nearest.point) > 0.0) ++outside;
    }
    const double all = static_cast<double>(carried.size());
    return static_cast<double>(known) >= options.min_known * all &&
           static_cast<double>(outside) <= options.max_outside * all;
  };
  const std::vector<SelfMatch> turns = likely_turns(samples, middle, options.alike);
  std::vector<std::uint8_t> fit(turns.size(), 0);
  parallel_for(turns.size(), [&](std::size_t t) { fit[t] = fits(turns[t]); });
  const auto first = std::ranges::find(fit, 1);
  return first == fit.end() ? std::nullopt : std::optional(turns[static_cast<std::size_t>(first - fit.begin())]);
}

}  // namespace scanrig
