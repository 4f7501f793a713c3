#include "daemon/rig/exposure_choice.h"

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>

namespace scanrig {
namespace {

constexpr int kTile = 16;              // px: some spots of the pattern and gaps
constexpr double kBrightestOf = 0.05;  // of a tile's pixels: what its brightest spots reach
constexpr int kDark = 40;              // grey values that a dark tile stays below, 1/6 of full scale
constexpr int kSaturated = 250;
constexpr double kDarkShare = 0.01;         // of the tiles: corners and shadows of a light object are less
constexpr double kSaturatedShare = 0.0005;  // of the pixels: single highlights are less

/// Grey value that only kBrightestOf of the tile's values exceed.
int bright_of(const cv::Mat& tile) {
  std::array<int, 256> count{};
  const int width = tile.cols * tile.channels();
  for (int y = 0; y < tile.rows; ++y) {
    const auto* row = tile.ptr<uchar>(y);
    for (int x = 0; x < width; ++x) ++count[row[x]];
  }
  int left = static_cast<int>(kBrightestOf * tile.rows * width), grey = 255;
  while (grey > 0 && (left -= count[static_cast<std::size_t>(grey)]) >= 0) --grey;
  return grey;
}

double dark_share(const ExposedPair& seen) {
  int tiles = 0, dark = 0;
  for (int y = 0; y + kTile <= seen.pattern.rows; y += kTile) {
    for (int x = 0; x + kTile <= seen.pattern.cols; x += kTile, ++tiles) {
      const cv::Rect tile(x, y, kTile, kTile);
      if (bright_of(seen.pattern(tile)) < kDark && bright_of(seen.plain(tile)) < kDark) ++dark;
    }
  }
  return tiles > 0 ? static_cast<double>(dark) / tiles : 0.0;
}

double saturated_share(const cv::Mat& image) {
  const cv::Mat values = image.reshape(1);
  return values.empty()
             ? 0.0
             : static_cast<double>(cv::countNonZero(values >= kSaturated)) / static_cast<double>(values.total());
}

}  // namespace

std::vector<double> wanted_exposures(const std::vector<ExposedPair>& seen, std::span<const double> offered) {
  std::vector<double> wanted;
  if (offered.empty()) return wanted;
  const bool is_dark =
      std::any_of(seen.begin(), seen.end(), [](const auto& one) { return dark_share(one) > kDarkShare; });
  const bool is_bright = std::any_of(seen.begin(), seen.end(),
                                     [](const auto& one) { return saturated_share(one.pattern) > kSaturatedShare; });
  for (const double factor : offered) {
    if (factor > 1.0 ? is_dark : is_bright) wanted.push_back(factor);
  }
  return wanted;
}

}  // namespace scanrig
