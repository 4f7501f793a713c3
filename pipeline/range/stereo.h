#pragma once

#include <opencv2/core/mat.hpp>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/rectification.h"

namespace scanrig {

struct StereoOptions {
  double min_zncc = 0.8;           ///< correlation below which a match is not believed
  double left_right_px = 0.3;      ///< the match from the right image must come back this near, or within 3 sigma
  double largest_sigma_px = 0.25;  ///< beyond it a pixel counts as not measured
  double enough_sigma_px = 0.08;   ///< a larger window is tried only above this
  double neighbour_px = 0.25;      ///< neighbours 4 px away must predict a pixel this well, or within 3 sigma
  int smallest_patch_px = 150;     ///< smaller islands are dropped
};

/// Two images whose rows correspond.
struct RectifiedPair {
  cv::Mat1f left, right;                ///< grey values, any scale of about 0..255
  cv::Mat1b left_object, right_object;  ///< not 0 on the object; empty: everywhere
  Projection left_projection;           ///< pinhole
  double right_cx = 0.0;                ///< px; the rest is as in the left image
  double baseline_mm = 0.0;             ///< the right camera's centre is at +x in the left camera's frame
  int min_disparity = 0;                ///< px, u_left - u_right
  int max_disparity = 0;
};

/// Depth of every object pixel of the left image: semi-global matching as a seed, then least-squares matching with
/// second-order shape functions, checked from the right image. `camera_from_pose` is left identity, `background` empty.
/// Sigma is of one pixel; errors of pixels closer than a window (15 px) are correlated.
/// Threads: spread over the current arena, same bits for any number.
/// Fails with `invalid_input` (sizes, no disparities to search), `degenerate` (nothing matched), `stopped`.
Result<RangeImage> match_rectified(const RectifiedPair& pair, const StereoOptions& options, const Context& context);

/// The same from the sensors' images with the dots on (8 bit, BGR or grey). Masks are in the rectified grids.
Result<RangeImage> match_stereo(const Rectification& rectification, const cv::Mat& left_pattern,
                                const cv::Mat& right_pattern, const cv::Mat1b& left_object,
                                const cv::Mat1b& right_object, const StereoOptions& options, const Context& context);

}  // namespace scanrig
