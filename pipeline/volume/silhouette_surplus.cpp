#include "pipeline/volume/silhouette_surplus.h"

#include <algorithm>
#include <opencv2/core.hpp>

namespace scanrig {

std::optional<SilhouetteFinding> Surplus::of(std::size_t s, const View& view) const {
  const cv::Mat1f& outside = outlines_[s].silhouette->outside_px;
  const int stride = options_.surplus_stride_px;
  cv::Mat1b grid(outside.rows / stride, outside.cols / stride, uchar{0});
  int inside = 0;
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.cols; ++x) {
      const cv::Point pixel(x * stride + stride / 2, y * stride + stride / 2);
      if (!(static_cast<double>(outside(pixel)) < -options_.contour_px)) continue;
      ++inside;
      grid(y, x) = is_empty(s, pixel) ? 255 : 0;
    }
  }
  const int empty = cv::countNonZero(grid);
  SilhouetteFinding finding{.kind = SilhouetteFinding::Kind::surplus,
                            .view = view.index,
                            .camera = outlines_[s].camera,
                            .area_px = 1.0 * empty * stride * stride,
                            .share = empty / std::max(1.0, 1.0 * inside),
                            .views = options_.min_silhouettes};
  if (empty < 2 || finding.share < options_.min_surplus) return std::nullopt;
  return finding;
}

bool Surplus::is_empty(std::size_t s, cv::Point pixel) const {
  const PosedOutline& own = outlines_[s];
  const Projection& projection = own.silhouette->projection;
  const Eigen::Vector3f ray = own.rotation.transpose() * projection.unproject(pixel.x, pixel.y, 1.0).cast<float>();
  const Eigen::Vector3f eye = -(own.rotation.transpose() * own.translation);
  const float middle = (box_.center() - eye).norm() / ray.norm(), reach = 0.5F * box_.diagonal().norm() / ray.norm();
  const auto step = static_cast<float>(options_.contour_px * projection.mm_per_pixel(static_cast<double>(middle)));
  // From the middle, where the object is: most rays meet it.
  for (float away = 0.0F; away <= reach; away += step) {
    if (!is_outside(s, eye + (middle + away) * ray) || !is_outside(s, eye + (middle - away) * ray)) return false;
  }
  return true;
}

bool Surplus::is_outside(std::size_t s, const Eigen::Vector3f& point) const {
  if (!box_.contains(point)) return true;
  int outside = 0;
  for (std::size_t o = 0; o < outlines_.size() && outside < options_.min_silhouettes; ++o) {
    if (o != s && outlines_[o].outside_px(point) > options_.contour_px) ++outside;
  }
  return outside >= options_.min_silhouettes;
}

}  // namespace scanrig
