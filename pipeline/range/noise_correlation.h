#pragma once

#include <opencv2/core/types.hpp>
#include <utility>
#include <vector>

#include "pipeline/range/window_match.h"

namespace scanrig {

/// A matched pixel of the image that `here` names.
struct MatchedPixel {
  cv::Point at;
  DisparityPatch patch;
};

/// By how much a disparity is noisier than residual noise and normal matrix say, because the noise of neighbouring
/// pixels is alike (demosaicing, resampling, smoothing): root of the sum over all shifts of the residuals'
/// autocorrelation times the gradient's, the variance of a least-squares estimate under coloured noise. Measured from
/// the residuals of `pixels` themselves. Returns 0 for fewer than 20 pixels. Same bits for any number of threads.
float noise_correlation(const MatchImage& here, const MatchImage& there, const MatchMask& mask,
                        const std::vector<MatchedPixel>& pixels, const WindowOptions& options);

}  // namespace scanrig
