#include "pipeline/storage/grid_surface.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace scanrig {
namespace {

/// Maximum depth change over one cell, in units of the cell: 75 degrees of incidence.
constexpr double kMaxSlope = 3.7;
/// Minimum number of the nine cells around for a plane.
constexpr int kMinNeighbours = 5;
/// Noise along the normal, mm: Stanford's dragon scans (cells of 0.5 x 0.7 mm) lie about 0.10 mm (median) off their
/// neighbours' surfaces at up to 50 degrees of incidence and 0.15 mm beyond, the sum of two scans' noise.
constexpr double kNoise = 0.1;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// Slopes dz/dx and dz/dy of the least-squares plane through the cells around (row, col) on the same surface; NaN with
/// too few cells.
Eigen::Vector2d slopes_at(const cv::Mat1f& depth, int row, int col, double dx, double dy) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double centre = depth(row, col);
  int count = 0;
  for (int j = std::max(row - 1, 0); j <= std::min(row + 1, depth.rows - 1); ++j) {
    for (int i = std::max(col - 1, 0); i <= std::min(col + 1, depth.cols - 1); ++i) {
      const Eigen::Vector3d basis((i - col) * dx, (j - row) * dy, 1.0);
      const double step = depth(j, i) - centre;
      if (!(std::abs(step) <= kMaxSlope * basis.head<2>().norm())) continue;
      normal += basis * basis.transpose();
      right += basis * step;
      ++count;
    }
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  const bool flat = count >= kMinNeighbours && normal.determinant() > 0.1 * std::pow(dx * dy, 2);
  return flat ? Eigen::Vector2d(solver.solve(right).head<2>()) : Eigen::Vector2d::Constant(kUnknown);
}

}  // namespace

RangeImage range_image_of_grid(const Projection& projection, const Transform& camera_from_pose,
                               const cv::Mat1f& depth) {
  RangeImage image;
  image.projection = projection;
  image.camera_from_pose = camera_from_pose;
  image.depth.create(depth.size());
  image.sigma.create(depth.size());
  image.normal.create(depth.size());
  parallel_for(static_cast<std::size_t>(depth.rows), [&](std::size_t r) {
    const int row = static_cast<int>(r);
    for (int col = 0; col < depth.cols; ++col) {
      image.depth(row, col) = image.sigma(row, col) = kUnknown;
      image.normal(row, col) = cv::Vec3f::all(kUnknown);
      if (!std::isfinite(depth(row, col))) continue;
      const Eigen::Vector2d slope = slopes_at(depth, row, col, 1.0 / projection.fx, 1.0 / projection.fy);
      if (!slope.allFinite()) continue;
      const Eigen::Vector3f normal = Eigen::Vector3d(slope.x(), slope.y(), -1.0).normalized().cast<float>();
      image.depth(row, col) = depth(row, col);
      image.sigma(row, col) = static_cast<float>(kNoise * std::hypot(1.0, slope.norm()));
      image.normal(row, col) = cv::Vec3f(normal.x(), normal.y(), normal.z());
    }
  });
  return image;
}

}  // namespace scanrig
