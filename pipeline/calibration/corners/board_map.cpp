#include "pipeline/calibration/corners/board_map.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace scanrig {
namespace {

constexpr std::size_t kPointsForLens = 40;

std::optional<Eigen::Matrix3d> find_homography(const std::vector<BoardPoint>& points, int method, double tolerance_px) {
  if (points.size() < 4) return std::nullopt;
  std::vector<cv::Point2d> from, to;
  for (const BoardPoint& point : points) {
    from.emplace_back(point.on_board.x(), point.on_board.y());
    to.emplace_back(point.pixel.x(), point.pixel.y());
  }
  cv::Mat found;
  try {
    found = cv::findHomography(from, to, method, tolerance_px);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  if (found.empty()) return std::nullopt;
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = found.at<double>(i / 3, i % 3);
  if (!matrix.allFinite() || std::abs(matrix.determinant()) < 1e-12) return std::nullopt;
  return matrix;
}

Eigen::Matrix<double, 10, 1> cubic(const Eigen::Vector2d& at) {
  const double x = at.x();
  const double y = at.y();
  Eigen::Matrix<double, 10, 1> terms;
  terms << 1.0, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return terms;
}

}  // namespace

std::optional<BoardMap> BoardMap::fit(const std::vector<BoardPoint>& points) {
  const auto homography = find_homography(points, 0, 0.0);
  if (!homography) return std::nullopt;
  BoardMap map;
  map.homography_ = *homography;
  if (points.size() >= kPointsForLens) map.fit_lens(points);
  return map;
}

std::optional<BoardMap> BoardMap::fit_robustly(const std::vector<BoardPoint>& points, double tolerance_px) {
  const auto homography = find_homography(points, cv::RANSAC, tolerance_px);
  if (!homography) return std::nullopt;
  BoardMap map;
  map.homography_ = *homography;
  return map;
}

void BoardMap::fit_lens(const std::vector<BoardPoint>& points) {
  Eigen::Vector2d lower = points.front().on_board;
  Eigen::Vector2d upper = lower;
  for (const BoardPoint& point : points) {
    lower = lower.cwiseMin(point.on_board);
    upper = upper.cwiseMax(point.on_board);
  }
  middle_ = 0.5 * (lower + upper);
  extent_ = std::max(0.5 * (upper - lower).minCoeff(), 1e-9);
  Eigen::Matrix<double, 10, 10> normal = 1e-3 * Eigen::Matrix<double, 10, 10>::Identity();
  Eigen::Matrix<double, 10, 2> slope = Eigen::Matrix<double, 10, 2>::Zero();
  for (const BoardPoint& point : points) {
    const auto terms = cubic((point.on_board - middle_) / extent_);
    normal += terms * terms.transpose();
    slope += terms * (point.pixel - pixel(point.on_board)).transpose();
  }
  lens_ = normal.ldlt().solve(slope);
}

Eigen::Vector2d BoardMap::pixel(const Eigen::Vector2d& on_board) const {
  const Eigen::Vector3d p = homography_ * on_board.homogeneous();
  return p.hnormalized() + lens_.transpose() * cubic((on_board - middle_) / extent_);
}

Eigen::Matrix2d BoardMap::jacobian(const Eigen::Vector2d& on_board) const {
  constexpr double kStep = 0.1;  // mm
  Eigen::Matrix2d matrix;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
    matrix.col(i) = (pixel(on_board + step) - pixel(on_board - step)) / (2.0 * kStep);
  }
  return matrix;
}

}  // namespace scanrig
