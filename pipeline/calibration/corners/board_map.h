#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace scanrig {

/// A point of the print and where an image shows it.
struct BoardPoint {
  Eigen::Vector2d on_board;  ///< mm, board frame
  Eigen::Vector2d pixel;
};

/// Smooth mapping of the print into an image: a homography, and with many points a cubic on top for the lens.
class BoardMap {
 public:
  /// Least squares over all points. No value: fewer than 4 points or all on a line.
  static std::optional<BoardMap> fit(const std::vector<BoardPoint>& points);
  /// The same, homography only, over the largest set of points that agree within `tolerance_px`.
  static std::optional<BoardMap> fit_robustly(const std::vector<BoardPoint>& points, double tolerance_px);

  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector2d& on_board) const;
  /// d pixel / d board, pixels per mm.
  [[nodiscard]] Eigen::Matrix2d jacobian(const Eigen::Vector2d& on_board) const;
  [[nodiscard]] const Eigen::Matrix3d& homography() const { return homography_; }

 private:
  void fit_lens(const std::vector<BoardPoint>& points);

  Eigen::Matrix3d homography_ = Eigen::Matrix3d::Identity();
  Eigen::Vector2d middle_{0.0, 0.0};
  double extent_ = 1.0;
  Eigen::Matrix<double, 10, 2> lens_ = Eigen::Matrix<double, 10, 2>::Zero();
};

}  // namespace scanrig
