#include "pipeline/calibration/distortion_table.h"

#include <algorithm>
#include <cmath>

namespace scanrig {
namespace {

constexpr int kCells = 160;  // across the image

}  // namespace

DistortionTable::DistortionTable(const Camera& camera) {
  Camera at_origin = camera;
  at_origin.camera_from_turntable = Transform::Identity();
  const Projection& p = camera.projection;
  const double margin = kMargin * p.width;
  first_ = {-margin, -margin};
  stride_ = static_cast<double>(p.width) / kCells;
  columns_ = static_cast<int>(std::ceil((p.width + 2.0 * margin) / stride_)) + 1;
  rows_ = static_cast<int>(std::ceil((p.height + 2.0 * margin) / stride_)) + 1;
  added_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d pinhole = first_ + stride_ * Eigen::Vector2d(column, row);
      added_.emplace_back(at_origin.project(p.unproject(pinhole.x(), pinhole.y(), 1.0)) - pinhole);
    }
  }
}

/// Beyond the table its border counts on: nothing there is in the image.
Eigen::Vector2d DistortionTable::distorted(const Eigen::Vector2d& pinhole_pixel) const {
  const double x = std::clamp((pinhole_pixel.x() - first_.x()) / stride_, 0.0, columns_ - 1.001);
  const double y = std::clamp((pinhole_pixel.y() - first_.y()) / stride_, 0.0, rows_ - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const double right = x - column, down = y - row;
  const Eigen::Vector2d* above =
      &added_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
  const Eigen::Vector2d* below = above + columns_;
  return pinhole_pixel + (1.0 - down) * ((1.0 - right) * above[0] + right * above[1]) +
         down * ((1.0 - right) * below[0] + right * below[1]);
}

}  // namespace scanrig
