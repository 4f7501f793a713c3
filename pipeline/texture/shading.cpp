#include "pipeline/texture/shading.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace scanrig {

namespace {

/// The curve by table: sRGB is steepest at 0, where a cell is narrower than a level, so a cell has at most one step.
class SrgbTable {
 public:
  SrgbTable() {
    for (std::size_t level = 1; level < 256; ++level) start_[level] = start_of(static_cast<int>(level));
    start_.back() = 2.0F;
    std::size_t level = 0;
    for (std::size_t cell = 0; cell < first_.size(); ++cell) {
      while (static_cast<float>(cell) / kCells >= start_[level + 1]) ++level;
      first_[cell] = static_cast<std::uint8_t>(level);
    }
  }
  [[nodiscard]] uchar operator()(float linear) const {
    const float v = linear > 0.0F ? std::min(linear, 1.0F) : 0.0F;
    const std::size_t level = first_[static_cast<std::size_t>(v * kCells)];
    return static_cast<uchar>(level + (v >= start_[level + 1] ? 1 : 0));
  }

 private:
  static constexpr int kCells = 4096;

  static int level_of(float v) {
    const float e = v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1.0F / 2.4F) - 0.055F;
    return static_cast<int>(std::lround(255.0F * e));
  }
  /// The smallest linear value of a level: the bits of positive numbers are in their order.
  static float start_of(int level) {
    std::uint32_t low = 0, high = std::bit_cast<std::uint32_t>(1.0F);
    while (low < high) {
      const std::uint32_t middle = (low + high) / 2;
      if (level_of(std::bit_cast<float>(middle)) >= level) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return std::bit_cast<float>(low);
  }

  std::array<float, 257> start_{};                ///< of each level; the last is never reached
  std::array<std::uint8_t, kCells + 1> first_{};  ///< level at the start of each cell
};

}  // namespace

cv::Vec3b to_srgb(const Eigen::Vector3f& linear) {
  static const SrgbTable table;
  return {table(linear[0]), table(linear[1]), table(linear[2])};
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
