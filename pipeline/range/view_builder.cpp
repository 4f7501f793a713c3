#include "pipeline/range/view_builder.h"

#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <utility>

#include "core/parallel.h"
#include "pipeline/range/free_space.h"

namespace scanrig {
namespace {

Result<Silhouette> silhouette_of(const cv::Mat& plain, const cv::Mat& pattern, const RectifyingMap& map,
                                 const Projection& projection, const Transform& camera_from_pose,
                                 const BlueScreenOptions& options) {
  const auto image = rectified(map, plain), lit = rectified(map, pattern, Resampling::linear);
  if (!image) return pass_on(image);
  if (!lit) return pass_on(lit);
  try {
    auto outline = blue_screen_outline(*image, *lit, options);
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

/// Of the left and the right camera; none of grey images. `not_found`: there is no screen to key by, or nothing of
/// another colour.
Result<std::vector<Silhouette>> silhouettes_of(const Rectification& rectification, const StereoImages& images,
                                               double angle_rad, const ViewOptions& options) {
  std::vector<Silhouette> result;
  if (images.left_pattern.channels() != 3) return result;
  std::array<Result<Silhouette>, 2> made{fail(ErrorCode::internal, ""), fail(ErrorCode::internal, "")};
  parallel_for(made.size(), [&](std::size_t i) {
    const bool is_left = i == 0;
    made[i] = silhouette_of(
        is_left ? images.left_plain : images.right_plain, is_left ? images.left_pattern : images.right_pattern,
        is_left ? rectification.left_map : rectification.right_map, is_left ? rectification.left : rectification.right,
        (is_left ? rectification.left_from_turntable : rectification.right_from_turntable) * rot_y(angle_rad),
        options.silhouette);
  });
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (!made[i]) return pass_on(made[i], i == 0 ? "left image" : "right image");
    result.push_back(std::move(*made[i]));
  }
  return result;
}

Result<TwoLights> two_lights(const RectifyingMap& map, const cv::Mat& pattern, const cv::Mat& plain) {
  auto grey = rectified_grey(map, pattern);
  if (!grey) return pass_on(grey);
  if (plain.empty() || plain.channels() != 3) return TwoLights{std::move(*grey), {}};
  auto colour = rectified(map, plain);
  if (!colour) return pass_on(colour);
  return TwoLights{std::move(*grey), std::move(*colour)};
}

/// Without a key: background, and what is not background as silhouettes. They hold more than the object.
Result<void> add_free_space(View& view, const Rectification& rectification, const StereoImages& images,
                            const ViewOptions& options) {
  const auto left = two_lights(rectification.left_map, images.left_pattern, images.left_plain);
  if (!left) return pass_on(left);
  const auto right = two_lights(rectification.right_map, images.right_pattern, images.right_plain);
  if (!right) return pass_on(right);
  FreeSpaceOptions free_options;
  free_options.clearance_mm = options.table_clearance_mm;
  if (!options.plain_differs) free_options.rounds = 0;
  auto seen = free_space(rectification, view.range, *left, *right, free_options);
  if (!seen) return pass_on(seen);
  cv::compare(seen->left, options.background_px, view.range.background, cv::CMP_GT);
  view.range.background_is_whole = false;
  for (const bool is_left : {true, false}) {
    view.silhouettes.push_back(
        {is_left ? rectification.left : rectification.right,
         (is_left ? rectification.left_from_turntable : rectification.right_from_turntable) * rot_y(view.angle_rad),
         is_left ? seen->left : seen->right});
  }
  return {};
}

}  // namespace

Result<View> make_view(const Rectification& rectification, const StereoImages& images, double angle_rad, int index,
                       const ViewOptions& options, const Context& context) {
  View view;
  view.index = index;
  view.angle_rad = angle_rad;
  const Transform left_from_pose = rectification.left_from_turntable * rot_y(angle_rad);
  auto silhouettes = silhouettes_of(rectification, images, angle_rad, options);
  const bool has_key = silhouettes || silhouettes.error().code != ErrorCode::not_found;
  if (!silhouettes && has_key) return pass_on(silhouettes);
  cv::Mat1b left_object, right_object;
  if (silhouettes) view.silhouettes = std::move(*silhouettes);
  if (!view.silhouettes.empty()) {
    left_object = inside(view.silhouettes[0], options.mixed_px);
    right_object = inside(view.silhouettes[1], options.mixed_px);
  }
  auto range = match_stereo(rectification, images.left_pattern, images.right_pattern, left_object, right_object,
                            options.stereo, context);
  if (!range && !has_key) return fail(ErrorCode::degenerate, "{}", silhouettes.error().message);
  if (!range) return pass_on(range);
  view.range = std::move(*range);
  view.range.camera_from_pose = left_from_pose;
  if (!view.silhouettes.empty()) {
    cv::compare(view.silhouettes.front().outside_px, options.background_px, view.range.background, cv::CMP_GT);
    for (int v = 0; v < view.range.depth.rows; ++v) {
      for (int u = 0; u < view.range.depth.cols; ++u) {
        if (view.silhouettes.front().outside_px(v, u) > -options.rim_px) clear_pixel(view.range, u, v);
      }
    }
  } else {
    if (auto done = add_free_space(view, rectification, images, options); !done) return pass_on(done);
    cut_at_table(view.range, rectification, options.table_clearance_mm);
    if (cv::countNonZero(view.range.depth == view.range.depth) == 0) {
      if (!has_key) return fail(ErrorCode::degenerate, "{}", silhouettes.error().message);
      return fail(ErrorCode::degenerate,
                  "range: no surface was measured above the table; check that the object is on the table");
    }
  }
  return view;
}

}  // namespace scanrig
