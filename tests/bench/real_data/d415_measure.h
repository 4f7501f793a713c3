#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig::bench {

/// A real random-dot pair (Intel RealSense D415, infrared, 1280x720: a dark bowl on a white sheet), matched.
/// Sheet region: the polygon between the sheet's edges and the tools at its left, less the bowl and its segmentation
/// (which belongs to another image), both grown by 20 px.
/// Rim: heights over the sheet's quadric along 120 rays from the bowl's centre. The bowl's wall is the median height 46
/// to 56 px from it; rays count whose wall both matchers measure and see more than 1 px nearer than the sheet. Coming
/// from outside, the rim lies between 10 and 90 % of the wall. Its width is given twice, as the median over the rays:
/// the length that contains measured values between the two (a smeared edge), and the distance between the two with
/// unmeasured pixels bridged (a matcher that leaves an edge out is wide here without being wrong).
struct D415Measure {
  double rms_px = 0.0;    ///< of the sheet from its fitted quadric, after taking out pixels more than 1 px off
  double coverage = 0.0;  ///< share of the sheet region measured and within 1 px of the quadric
  double rim_smeared_px = 0.0;
  double rim_bridged_px = 0.0;
};

struct D415Comparison {
  D415Measure ours;
  D415Measure sgbm;             ///< OpenCV's SGBM, block 9, 3WAY, on the images brightened three times
  double error_by_sigma = 0.0;  ///< of our sheet: median distance from the quadric in sigma, by a normal distribution's
  int rim_rays = 0;             ///< number of rays that count
  double seconds = 0.0;
};

/// `folder` holds image0.png, image1.png, real_segment_image_0.npy. `change_right`: what is done to the right image
/// before matching. Fails with `not_found` or as match_rectified()
/// does.
Result<D415Comparison> measure_d415(const std::filesystem::path& folder,
                                    const std::function<cv::Mat1f(const cv::Mat1f&)>& change_right = {});

}  // namespace scanrig::bench
