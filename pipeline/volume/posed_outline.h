#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/range/range_image.h"

namespace scanrig {

/// One silhouette as a camera of the pose. Refers to its view.
struct PosedOutline {
  Silhouette* silhouette;
  std::size_t view;  ///< in the span
  std::size_t camera;
  Eigen::Matrix3f rotation;
  Eigen::Vector3f translation;

  /// On the sensor; it may be cropped off.
  [[nodiscard]] std::optional<cv::Point> pixel_of(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f p = rotation * point + translation;
    if (!(p.z() > 0.0F)) return std::nullopt;
    const Projection& projection = silhouette->projection;
    const cv::Point at(static_cast<int>(std::lround(projection.fx * p.x() / p.z() + projection.cx)),
                       static_cast<int>(std::lround(projection.fy * p.y() / p.z() + projection.cy)));
    return holds(at) || projection.is_cropped_off({at.x, at.y}) ? std::optional(at) : std::nullopt;
  }
  [[nodiscard]] bool holds(const cv::Point& pixel) const {
    return pixel.inside({0, 0, silhouette->outside_px.cols, silhouette->outside_px.rows});
  }
  /// Of a point, in pixels, positive outside; nothing is outside beyond the sensor: the object is inside of it.
  [[nodiscard]] double outside_px(const Eigen::Vector3f& point) const {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const auto at = pixel_of(point);
    return !at ? -kFar : holds(*at) ? static_cast<double>(silhouette->outside_px(*at)) : kFar;
  }
};

/// Those of all views, in their order.
inline std::vector<PosedOutline> outlines_of(std::span<View> views) {
  std::vector<PosedOutline> outlines;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (std::size_t c = 0; c < views[v].silhouettes.size(); ++c) {
      Silhouette& s = views[v].silhouettes[c];
      outlines.push_back(
          {&s, v, c, s.camera_from_pose.linear().cast<float>(), s.camera_from_pose.translation().cast<float>()});
    }
  }
  return outlines;
}

}  // namespace scanrig
