#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace scanrig::sim {

/// The light (32-bit float RGB, 1.0 = full scale) behind lens and colour filters (RGGB): one channel, 32-bit float.
/// `image_scale`: resolution as a share of the full sensor's; the blur is that of the full sensor. `extra_sigma_px`:
/// blur of a lens out of focus besides, pixels of the full sensor.
cv::Mat through_lens(const cv::Mat& light, double image_scale, double extra_sigma_px = 0.0);

/// The sensor's image of that light: vignetting, shot and read noise, 8 bits, linear. `noise_key` names the exposure:
/// the same key gives the same noise; 0 gives none. `noise_factor`: of its standard deviation.
cv::Mat expose(const cv::Mat& on_sensor, std::uint64_t noise_key, double noise_factor = 1.0);

}  // namespace scanrig::sim
