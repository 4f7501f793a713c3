#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace scanrig::sim {

/// What lens and sensor make of the light (32-bit float RGB, 1.0 = full scale): blur, vignetting, colour filters
/// (RGGB), shot and read noise, 8 bits, linear. `image_scale`: resolution as a share of the full sensor's; the blur is
/// that of the full sensor. `noise_key` names the exposure: the same key gives the same noise; 0 gives none.
cv::Mat expose(const cv::Mat& light, double image_scale, std::uint64_t noise_key);

}  // namespace scanrig::sim
