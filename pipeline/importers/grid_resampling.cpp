#include "pipeline/importers/grid_resampling.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pipeline/importers/depth_drawing.h"

namespace scanrig {
namespace {

/// A triangle is surface if none of its edges is longer than this many median cell diagonals: 75 degrees of incidence.
constexpr double kMaxEdge = 4.0;

/// Direction of the scanner's rays, away from it. Within a column x, and within a row y, change with z alone: their
/// slopes are the ray's. Least squares of x = a col + b z + c and y = a row + b z + c; robust enough, since every cell
/// counts.
Eigen::Vector3d ray_direction(const RangeGrid& scan) {
  std::array<Eigen::Matrix3d, 2> normal{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  std::array<Eigen::Vector3d, 2> right{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int row = 0; row < scan.rows; ++row) {
    for (int col = 0; col < scan.cols; ++col) {
      if (scan.at(row, col) < 0) continue;
      const Eigen::Vector3d& p = scan.points[static_cast<std::size_t>(scan.at(row, col))];
      for (int k = 0; k < 2; ++k) {
        const Eigen::Vector3d basis(k == 0 ? col : row, p.z(), 1.0);
        normal[k] += basis * basis.transpose();
        right[k] += basis * p[k];
      }
    }
  }
  Eigen::Vector3d direction(0.0, 0.0, 1.0);
  for (int k = 0; k < 2; ++k) direction[k] = Eigen::Vector3d(normal[k].ldlt().solve(right[k]))[1];
  return -direction.normalized();
}

/// Camera axes: z along the rays, y down, x to the right from the scanner's side.
Transform camera_of(const Eigen::Vector3d& ray) {
  const Eigen::Vector3d x = (-Eigen::Vector3d::UnitY()).cross(ray).normalized();
  Eigen::Matrix3d rows;
  rows << x.transpose(), ray.cross(x).transpose(), ray.transpose();
  Transform camera_from_scan = Transform::Identity();
  camera_from_scan.linear() = rows;
  return camera_from_scan;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Frames the points with a grid of the cells' median spacing, and returns that spacing's diagonal.
Result<double> lay_grid(const RangeGrid& scan, const std::vector<Eigen::Vector3d>& points, Projection& grid) {
  std::vector<double> across, down;
  for (int row = 0; row + 1 < scan.rows; ++row) {
    for (int col = 0; col + 1 < scan.cols; ++col) {
      const int here = scan.at(row, col), right = scan.at(row, col + 1), below = scan.at(row + 1, col);
      if (here < 0 || right < 0 || below < 0) continue;
      across.push_back(std::abs(points[right].x() - points[here].x()));
      down.push_back(std::abs(points[below].y() - points[here].y()));
    }
  }
  if (across.empty()) return fail(ErrorCode::degenerate, "no neighbouring cells are measured");
  const double dx = median(across), dy = median(down);
  if (!(dx > 1e-6) || !(dy > 1e-6)) return fail(ErrorCode::degenerate, "the cells lie on a line");
  Eigen::Vector2d low = points.front().head<2>(), high = low;
  for (const auto& p : points) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  }
  grid = {Projection::Kind::orthographic, 0, 0, 1.0 / dx, 1.0 / dy, 1.0 - low.x() / dx, 1.0 - low.y() / dy};
  const Eigen::Vector2d last = grid.project({high.x(), high.y(), 0.0});
  if (last.maxCoeff() > 20000.0) return fail(ErrorCode::degenerate, "the grid's spacing does not fit its extent");
  grid.width = static_cast<int>(last.x()) + 2;
  grid.height = static_cast<int>(last.y()) + 2;
  return std::hypot(dx, dy);
}

}  // namespace

Result<ResampledGrid> resample(const RangeGrid& scan) {
  if (scan.points.empty()) return fail(ErrorCode::degenerate, "the scan holds no points");
  ResampledGrid result;
  result.camera_from_scan = camera_of(ray_direction(scan));
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : scan.points) points.push_back(result.camera_from_scan * p);
  const auto diagonal = lay_grid(scan, points, result.grid);
  if (!diagonal) return pass_on(diagonal);
  result.depth = cv::Mat1f(result.grid.height, result.grid.width, std::numeric_limits<float>::quiet_NaN());

  const auto draw_surface = [&](const std::array<int, 3>& cells) {
    if (*std::min_element(cells.begin(), cells.end()) < 0) return;
    const std::array<Eigen::Vector3d, 3> corners{points[cells[0]], points[cells[1]], points[cells[2]]};
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) longest = std::max(longest, (corners[(k + 1) % 3] - corners[k]).norm());
    if (longest <= kMaxEdge * *diagonal) draw_triangle(corners, result.grid, result.depth);
  };
  for (int row = 0; row + 1 < scan.rows; ++row) {
    for (int col = 0; col + 1 < scan.cols; ++col) {
      const int a = scan.at(row, col), b = scan.at(row, col + 1);
      const int c = scan.at(row + 1, col), d = scan.at(row + 1, col + 1);
      // The diagonal that leaves a whole triangle where one corner is missing.
      if (a < 0 || d < 0) {
        draw_surface({a, b, c});
        draw_surface({b, d, c});
      } else {
        draw_surface({a, b, d});
        draw_surface({a, d, c});
      }
    }
  }
  return result;
}

}  // namespace scanrig
