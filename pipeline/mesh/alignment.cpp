#include "pipeline/mesh/alignment.h"

#include <Eigen/Dense>
#include <algorithm>

#include "core/parallel.h"
#include "core/statistics.h"

namespace scanrig {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

struct AlignedPair {
  Eigen::Vector3d point, target, normal;
  double distance = 0.0;
};

}  // namespace

Transform align(const std::vector<SurfaceSample>& samples, const Mesh& target, const SurfaceIndex& surface,
                const AlignmentOptions& options) {
  Transform motion = Transform::Identity();
  const std::size_t stride = std::max<std::size_t>(1, samples.size() / options.max_samples);
  std::vector<AlignedPair> pairs(samples.size() / stride);
  if (pairs.size() < 6) return motion;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    parallel_for(pairs.size() / 256 + 1, [&](std::size_t block) {
      for (std::size_t i = block * 256; i < std::min(pairs.size(), (block + 1) * 256); ++i) {
        const Eigen::Vector3d p = motion * samples[i * stride].point;
        const auto nearest = surface.nearest(p);
        const Mesh::Face& f = target.faces[nearest.face];
        const Eigen::Vector3d a = target.vertices[f[0]].cast<double>();
        const Eigen::Vector3d normal =
            (target.vertices[f[1]].cast<double>() - a).cross(target.vertices[f[2]].cast<double>() - a).normalized();
        pairs[i] = {p, nearest.point, normal, nearest.distance};
      }
    });
    std::vector<double> distances;
    for (const AlignedPair& pair : pairs) distances.push_back(pair.distance);
    const double limit = quantile(distances, options.keep);
    const Eigen::Vector3d centre = motion * samples.front().point;
    Matrix6d normal = Matrix6d::Identity() * 1e-6;
    Vector6d right = Vector6d::Zero();
    for (const AlignedPair& pair : pairs) {
      if (pair.distance > limit) continue;
      Vector6d row;
      row << (pair.point - centre).cross(pair.normal), pair.normal;
      normal += row * row.transpose();
      right += row * pair.normal.dot(pair.target - pair.point);
    }
    const Vector6d step = normal.ldlt().solve(right);
    Transform about_centre = small_motion(step.head<3>(), step.tail<3>());
    about_centre = Eigen::Translation3d(centre) * about_centre * Eigen::Translation3d(-centre);
    motion = about_centre * motion;
    if (step.norm() < 1e-7) break;
  }
  return motion;
}

}  // namespace scanrig
