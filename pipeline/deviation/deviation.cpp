#include "pipeline/deviation/deviation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/surface_index.h"

namespace scanrig {
namespace {

constexpr float kUnknownDeviation = std::numeric_limits<float>::quiet_NaN();
constexpr double kTouchMm = 1e-5;  // a face this near to a point has it; single precision of a part of 100 mm

struct FaceCorners {
  Eigen::Vector3d a, b, c;
};

FaceCorners corners_of(const Mesh& mesh, std::uint32_t face) {
  const auto& f = mesh.faces[face];
  return {mesh.vertices[f[0]].cast<double>(), mesh.vertices[f[1]].cast<double>(), mesh.vertices[f[2]].cast<double>()};
}

double angle_at(const Eigen::Vector3d& at, const Eigen::Vector3d& to, const Eigen::Vector3d& and_to) {
  const Eigen::Vector3d u = to - at, v = and_to - at;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// Outward direction at a point of the surface; nothing where the surface ends there.
std::optional<Eigen::Vector3d> normal_at(const Mesh& mesh, const SurfaceIndex& index, const Eigen::Vector3d& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int within = 0, at_edge = 0, at_corner = 0;
  index.near(point, kTouchMm, [&](std::uint32_t face) {
    const auto [a, b, c] = corners_of(mesh, face);
    if ((nearest_on_triangle(point, a, b, c) - point).norm() > kTouchMm) return;
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    if (!(cross.norm() > 0.0)) return;
    const Eigen::Vector3d normal = cross.normalized();
    const auto is_at = [&](const Eigen::Vector3d& corner) { return (corner - point).norm() <= kTouchMm; };
    const auto is_on = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return (point - from).cross(to - from).norm() <= kTouchMm * (to - from).norm();
    };
    if (is_at(a) || is_at(b) || is_at(c)) {
      ++at_corner;
      sum += normal * (is_at(a) ? angle_at(a, b, c) : is_at(b) ? angle_at(b, c, a) : angle_at(c, a, b));
    } else {
      const bool is_edge = is_on(a, b) || is_on(b, c) || is_on(c, a);
      ++(is_edge ? at_edge : within);
      sum += normal;
    }
  });
  if (within == 0 && at_corner == 0 && at_edge < 2) return std::nullopt;
  return sum;
}

float deviation_at(const Mesh& reference, const SurfaceIndex& index, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal) {
  const auto nearest = index.nearest(point);
  const auto outwards = normal_at(reference, index, nearest.point);
  if (!outwards || outwards->dot(normal) <= 0.0) return kUnknownDeviation;
  return static_cast<float>((point - nearest.point).dot(*outwards) < 0.0 ? -nearest.distance : nearest.distance);
}

Result<void> add_figures(Deviation& deviation) {
  std::vector<double> known, absolute;
  for (const float mm : deviation.mm) {
    if (std::isfinite(mm)) known.push_back(mm);
  }
  if (known.empty()) {
    return fail(ErrorCode::degenerate, "deviation: no measured surface lies at the reference; scan the part again");
  }
  for (const double mm : known) {
    absolute.push_back(std::abs(mm));
    deviation.mean_mm += mm / static_cast<double>(known.size());
  }
  deviation.known_share = static_cast<double>(known.size()) / static_cast<double>(deviation.mm.size());
  deviation.rms_mm = root_mean_square(known);
  deviation.p95_mm = quantile(absolute, 0.95);
  const auto [min, max] = std::ranges::minmax(known);
  deviation.min_mm = min;
  deviation.max_mm = max;
  return {};
}

}  // namespace

Result<Deviation> deviation_from(const Mesh& reference, const Mesh& model, const Transform& reference_from_model,
                                 const Context& context) {
  const auto index = SurfaceIndex::create(reference);
  if (!index) return pass_on(index, "deviation");
  const bool has_normals = model.normals.size() == model.vertices.size();
  const auto computed = has_normals ? std::vector<Eigen::Vector3f>() : vertex_normals(model);
  const auto& normals = has_normals ? model.normals : computed;
  const bool has_views = model.views.size() == model.vertices.size();
  Deviation deviation;
  deviation.mm.assign(model.vertices.size(), kUnknownDeviation);
  constexpr std::size_t kBlock = 256;
  parallel_for(model.vertices.size() / kBlock + 1, [&](std::size_t block) {
    const auto end = context.stopped() ? 0 : std::min(model.vertices.size(), (block + 1) * kBlock);
    for (std::size_t v = block * kBlock; v < end; ++v) {
      if (has_views && model.views[v] == 0) continue;
      deviation.mm[v] = deviation_at(reference, *index, reference_from_model * model.vertices[v].cast<double>(),
                                     reference_from_model.linear() * normals[v].cast<double>());
    }
  });
  if (context.stopped()) return fail(ErrorCode::stopped, "deviation: stopped");
  if (auto figures = add_figures(deviation); !figures) return pass_on(figures);
  return deviation;
}

}  // namespace scanrig
