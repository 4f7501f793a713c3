#include "pipeline/range/view_builder.h"

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace scanrig {
namespace {

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

cv::Mat1b inside(const Silhouette& silhouette, double mixed_px) {
  cv::Mat1b mask;
  cv::compare(silhouette.outside_px, -mixed_px, mask, cv::CMP_LT);
  return mask;
}

void clear_pixel(RangeImage& range, int u, int v) {
  range.depth(v, u) = range.sigma(v, u) = kUnmeasured;
  range.normal(v, u) = {kUnmeasured, kUnmeasured, kUnmeasured};
}

/// Without silhouettes: what is not above the table is not the object.
void cut_at_table(RangeImage& range, const Rectification& rectification, double clearance_mm) {
  const Transform turntable_from_left = rectification.left_from_turntable.inverse();
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      const double depth = static_cast<double>(range.depth(v, u));
      if (std::isnan(depth)) continue;
      const Eigen::Vector3d p = turntable_from_left * range.projection.unproject(u, v, depth);
      if (p.y() < clearance_mm || std::hypot(p.x(), p.z()) > rectification.table_radius_mm) clear_pixel(range, u, v);
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
    left_object = inside(*left, options.mixed_px);
    right_object = inside(*right, options.mixed_px);
    view.silhouettes = {std::move(*left), std::move(*right)};
  }
  auto range = match_stereo(rectification, images.left_pattern, images.right_pattern, left_object, right_object,
                            options.stereo, context);
  if (!range) return pass_on(range);
  view.range = std::move(*range);
  view.range.camera_from_pose = left_from_pose;
  if (colour) {
    cv::compare(view.silhouettes.front().outside_px, options.background_px, view.range.background, cv::CMP_GT);
    for (int v = 0; v < view.range.depth.rows; ++v) {
      for (int u = 0; u < view.range.depth.cols; ++u) {
        if (view.silhouettes.front().outside_px(v, u) > -options.rim_px) clear_pixel(view.range, u, v);
      }
    }
  } else {
    cut_at_table(view.range, rectification, options.table_clearance_mm);
    if (cv::countNonZero(view.range.depth == view.range.depth) == 0) {
      return fail(ErrorCode::degenerate,
                  "range: no surface was measured above the table; check that the object is on the table");
    }
  }
  return view;
}

}  // namespace scanrig
