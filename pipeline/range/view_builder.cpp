#include "pipeline/range/view_builder.h"

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace scanrig {
namespace {

// Pixels this near to the outline carry light from behind the object: they stay out of the matcher's windows.
constexpr double kMixedPx = 1.5;
// Depth this near to the outline is left out: the surface turns away there.
constexpr float kRimPx = 2.5f;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Result<Silhouette> silhouette_of(const cv::Mat& plain, const RectifyingMap& map, const Projection& projection,
                                 const Transform& camera_from_pose, const BlueScreenOptions& options) {
  const auto image = rectified(map, plain);
  if (!image) return pass_on(image);
  try {
    auto outline = blue_screen_outline(*image, options);
    if (!outline) return pass_on(outline);
    return Silhouette{projection, camera_from_pose, std::move(*outline)};
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "silhouette: {}", error.what());
  }
}

cv::Mat1b inside(const Silhouette& silhouette) {
  cv::Mat1b mask;
  cv::compare(silhouette.outside_px, -kMixedPx, mask, cv::CMP_LT);
  return mask;
}

void forget(RangeImage& range, int u, int v) {
  range.depth(v, u) = range.sigma(v, u) = kNaN;
  range.normal(v, u) = {kNaN, kNaN, kNaN};
}

/// Without silhouettes: what is not above the table is not the object.
void cut_at_table(RangeImage& range, const Rectification& rectification, double clearance_mm) {
  const Transform turntable_from_left = rectification.left_from_turntable.inverse();
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      const double depth = static_cast<double>(range.depth(v, u));
      if (std::isnan(depth)) continue;
      const Eigen::Vector3d p = turntable_from_left * range.projection.unproject(u, v, depth);
      if (p.y() < clearance_mm || std::hypot(p.x(), p.z()) > rectification.table_radius_mm) forget(range, u, v);
    }
  }
}

}  // namespace

Result<View> make_view(const Rectification& rectification, const StereoImages& images, double angle_rad, int index,
                       const ViewOptions& options, const Context& context) {
  View view;
  view.index = index;
  view.angle_rad = angle_rad;
  const Transform left_from_pose = rectification.left_from_turntable * rot_y(angle_rad);
  cv::Mat1b left_object, right_object;
  const bool colour = images.left_pattern.channels() == 3;
  if (colour) {
    auto left = silhouette_of(images.left_plain, rectification.left_map, rectification.left, left_from_pose,
                              options.silhouette);
    if (!left) return pass_on(left, "left image");
    auto right = silhouette_of(images.right_plain, rectification.right_map, rectification.right,
                               rectification.right_from_turntable * rot_y(angle_rad), options.silhouette);
    if (!right) return pass_on(right, "right image");
    left_object = inside(*left);
    right_object = inside(*right);
    view.silhouettes = {std::move(*left), std::move(*right)};
  }
  auto range = match_stereo(rectification, images.left_pattern, images.right_pattern, left_object, right_object,
                            options.stereo, context);
  if (!range) return pass_on(range);
  view.range = std::move(*range);
  view.range.camera_from_pose = left_from_pose;
  if (colour) {
    // One pixel off the outline, so that no mixed pixel claims free space.
    cv::compare(view.silhouettes.front().outside_px, 1.0, view.range.background, cv::CMP_GT);
    for (int v = 0; v < view.range.depth.rows; ++v) {
      for (int u = 0; u < view.range.depth.cols; ++u) {
        if (view.silhouettes.front().outside_px(v, u) > -kRimPx) forget(view.range, u, v);
      }
    }
  } else {
    cut_at_table(view.range, rectification, options.table_clearance_mm);
    if (cv::countNonZero(view.range.depth == view.range.depth) == 0) {
      return fail(ErrorCode::degenerate, "range: nothing was measured above the table; is it empty?");
    }
  }
  return view;
}

}  // namespace scanrig
