#include "pipeline/texture/shading.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scanrig {

cv::Vec3b to_srgb(const Eigen::Vector3f& linear) {
  cv::Vec3b encoded;
  for (int k = 0; k < 3; ++k) {
    const float v = std::clamp(linear[k], 0.0F, 1.0F);
    const float e = v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1.0F / 2.4F) - 0.055F;
    encoded[k] = static_cast<uchar>(std::lround(255.0F * e));
  }
  return encoded;
}

Eigen::Vector3f from_srgb(const cv::Vec3b& encoded) {
  static const auto table = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float e = static_cast<float>(i) / 255.0F;
      values[i] = e <= 0.04045F ? e / 12.92F : std::pow((e + 0.055F) / 1.055F, 2.4F);
    }
    return values;
  }();
  return {table[encoded[0]], table[encoded[1]], table[encoded[2]]};
}

double white_gain(std::vector<float> brightness, const WhiteOptions& options) {
  if (brightness.empty()) return 1.0;
  const auto white =
      brightness.begin() + static_cast<std::ptrdiff_t>(options.share * static_cast<double>(brightness.size() - 1));
  std::nth_element(brightness.begin(), white, brightness.end());
  return std::min(options.max_gain, options.white / std::max(1e-3, static_cast<double>(*white)));
}

}  // namespace scanrig
