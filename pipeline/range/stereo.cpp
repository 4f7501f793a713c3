#include "pipeline/range/stereo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "pipeline/range/coarse_disparity.h"
#include "pipeline/range/dense_match.h"
#include "pipeline/range/row_alignment.h"
#include "pipeline/silhouette/box_around.h"

namespace scanrig {
namespace {

Result<void> check(const RectifiedPair& pair) {
  const Projection& p = pair.left_projection;
  if (pair.left.empty() || pair.left.size() != pair.right.size() || pair.left.size() != cv::Size(p.width, p.height)) {
    return fail(ErrorCode::invalid_input, "range: the images have {}x{} and {}x{} pixels, the projection {}x{}",
                pair.left.cols, pair.left.rows, pair.right.cols, pair.right.rows, p.width, p.height);
  }
  for (const cv::Mat1b* mask : {&pair.left_object, &pair.right_object}) {
    if (!mask->empty() && mask->size() != pair.left.size()) {
      return fail(ErrorCode::invalid_input, "range: a mask has {}x{} pixels, the images {}x{}", mask->cols, mask->rows,
                  pair.left.cols, pair.left.rows);
    }
  }
  if (p.kind != Projection::Kind::pinhole || !(p.fx > 0) || !(p.fy > 0) || !(pair.baseline_mm > 0)) {
    return fail(ErrorCode::invalid_input, "range: a stereo pair needs a focal length and a baseline");
  }
  if (pair.min_disparity >= pair.max_disparity || pair.max_disparity - pair.min_disparity > pair.left.cols) {
    return fail(ErrorCode::invalid_input, "range: no disparities to search ({} to {} px)", pair.min_disparity,
                pair.max_disparity);
  }
  return {};
}

/// The rows that show the object, and some around.
cv::Range object_rows(const cv::Mat1b& mask, int height, int margin) {
  if (mask.empty()) return {0, height};
  int first = height, last = -1;
  for (int y = 0; y < height; ++y) {
    if (cv::countNonZero(mask.row(y)) == 0) continue;
    first = std::min(first, y);
    last = y;
  }
  return {std::max(0, first - margin), std::min(height, last + 1 + margin)};
}

/// Converts disparities into depth, its sigma, and the normal of the tangent plane.
RangeImage to_range(const RectifiedPair& pair, const DenseDisparity& disparity) {
  const Projection& p = pair.left_projection;
  const cv::Size size(p.width, p.height);
  RangeImage range{p,
                   Transform::Identity(),
                   cv::Mat1f(size, kUnmeasured),
                   cv::Mat1f(size, kUnmeasured),
                   cv::Mat3f(size, cv::Vec3f(kUnmeasured, kUnmeasured, kUnmeasured)),
                   {},
                   {}};
  const double strength = p.fx * pair.baseline_mm;
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      // Disparity between equal principal points: strength / depth.
      const double d = static_cast<double>(disparity.value(v, u)) - p.cx + pair.right_cx;
      if (!(d > 0.0)) continue;  // NaN too
      const double du = static_cast<double>(disparity.slope(v, u)[0]),
                   dv = static_cast<double>(disparity.slope(v, u)[1]);
      const double depth = strength / d;
      range.depth(v, u) = static_cast<float>(depth);
      range.sigma(v, u) = static_cast<float>(depth / d * static_cast<double>(disparity.sigma(v, u)));
      // d = a (u - cx) + b (v - cy) + c is the plane (a fx, b fy, c) . X = strength: a normal away from the camera.
      const Eigen::Vector3d away(du * p.fx, dv * p.fy, d - du * (u - p.cx) - dv * (v - p.cy));
      const Eigen::Vector3f normal = -away.normalized().cast<float>();
      range.normal(v, u) = {normal.x(), normal.y(), normal.z()};
    }
  });
  return range;
}

}  // namespace

Result<RangeImage> match_rectified(const RectifiedPair& given, const StereoOptions& options, const Context& context) {
  if (const auto fits = check(given); !fits) return pass_on(fits);
  const cv::Range rows = object_rows(given.left_object, given.left.rows, options.row_margin_px);
  if (rows.size() < options.min_rows) return fail(ErrorCode::degenerate, "range: the mask shows no object");
  context.report("range", 0.0);
  if (context.stopped()) return fail(ErrorCode::stopped, "range: stopped before matching");
  RectifiedPair pair = given;
  PairBoxes boxes;
  CoarseDisparity coarse;
  RowField corrected;
  try {
    boxes = object_boxes(pair, rows);
    coarse = coarse_disparity(pair, boxes);
    RowAlignmentOptions alignment;
    alignment.max_px = options.max_rows_px;
    const auto aligned = align_rows(pair, coarse, boxes, alignment);
    if (!aligned) return pass_on(aligned);
    corrected = *aligned;
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "range: semi-global matching: {}", error.what());
  }
  context.report("range", 0.2);
  auto disparity = dense_disparity(pair, coarse, boxes, options, context);
  if (!disparity) return pass_on(disparity);
  remove_outliers(*disparity, options);
  RangeImage range = to_range(pair, *disparity);
  if (cv::countNonZero(range.depth == range.depth) == 0) {
    return fail(ErrorCode::degenerate, "range: no stereo matches; check the projector and the calibration");
  }
  range.window_px = static_cast<float>(options.sharp_radii_px.front());
  range.row_offsets = find_row_offsets(pair, disparity->value, disparity->sigma, {}, corrected);
  context.report("range", 1.0);
  return range;
}

Result<RangeImage> match_stereo(const Rectification& rectification, const cv::Mat& left_pattern,
                                const cv::Mat& right_pattern, const cv::Mat1b& left_object,
                                const cv::Mat1b& right_object, const StereoOptions& options, const Context& context) {
  constexpr int kMargin = 64;  // px: more than what rows are searched in
  const auto left = rectified_grey(rectification.left_map, left_pattern, box_around(left_object, kMargin));
  if (!left) return pass_on(left, "left pattern image");
  const auto right = rectified_grey(rectification.right_map, right_pattern, box_around(right_object, kMargin));
  if (!right) return pass_on(right, "right pattern image");
  return match_rectified({*left, *right, left_object, right_object, rectification.left, rectification.right.cx,
                          rectification.baseline_mm, rectification.min_disparity, rectification.max_disparity},
                         options, context);
}

}  // namespace scanrig
