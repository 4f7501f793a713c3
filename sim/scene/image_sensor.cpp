#include "sim/scene/image_sensor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {

cv::Mat through_lens(const cv::Mat& light, double image_scale, double extra_sigma_px) {
  cv::Mat blurred;
  const double sigma = std::hypot(profile().lens_sigma_px, extra_sigma_px) * image_scale;
  cv::GaussianBlur(light, blurred, {}, sigma, sigma, cv::BORDER_REPLICATE);
  cv::Mat filtered(light.rows, light.cols, CV_32F);
  for (int y = 0; y < light.rows; ++y) {
    const auto* in = blurred.ptr<cv::Vec3f>(y);
    auto* out = filtered.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) out[x] = in[x][(x & 1) + (y & 1)];  // red, green or blue filter
  }
  return filtered;
}

cv::Mat expose(const cv::Mat& on_sensor, std::uint64_t noise_key, double noise_factor) {
  const Profile& p = profile();
  cv::Mat raw(on_sensor.rows, on_sensor.cols, CV_8U);
  const double cx = 0.5 * (raw.cols - 1), cy = 0.5 * (raw.rows - 1);
  parallel_for(static_cast<std::size_t>(raw.rows), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    const auto* in = on_sensor.ptr<float>(y);
    auto* out = raw.ptr<std::uint8_t>(y);
    for (int x = 0; x < raw.cols; ++x) {
      const double off = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (cx * cx + cy * cy);
      double grey = 255.0 * in[x] * (1.0 - p.vignetting * off);
      if (noise_key != 0) {
        const double variance = p.read_noise * p.read_noise + p.shot_noise_variance * std::max(0.0, grey);
        grey += noise_factor * std::sqrt(variance) * normal(mix(noise_key, row, x));
      }
      out[x] = static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0)));
    }
  });
  return raw;
}

}  // namespace scanrig::sim
