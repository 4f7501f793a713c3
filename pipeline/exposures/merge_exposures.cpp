#include "pipeline/exposures/merge_exposures.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr int kLevels = 256;
// Saturation begins below the highest value: pixels differ in gain, and noise clips.
constexpr double kFullyTrusted = 235.0, kSaturated = 250.0;
constexpr int kFitFrom = 16, kFitTo = 220;  // levels of the longer exposure that show the line between two
constexpr double kMinMean = 1.0;            // of the shorter one there: nothing of its noise was cut off at 0
constexpr int kMinPixels = 50;              // of a level
constexpr int kMinLevels = 30;
constexpr int kMaxValue = 65535;

/// 1 where a grey value is below saturation, 0 where it is not.
double trust(double grey) { return std::clamp((kSaturated - grey) / (kSaturated - kFullyTrusted), 0.0, 1.0); }

/// What one exposure says of a pixel, by its grey value; grey values of the first exposure.
struct Table {
  ExposureLine line;
  std::array<double, kLevels> value{}, trust{};

  explicit Table(const ExposureLine& from) : line(from) {
    for (int grey = 0; grey < kLevels; ++grey) {
      value[grey] = (grey - line.offset) / line.gain;
      trust[grey] = scanrig::trust(grey);
    }
  }

  /// Inverse variance where the first exposure's light is `grey`, before trust.
  [[nodiscard]] double weight(double grey, const NoiseModel& noise) const {
    return line.gain * line.gain / noise.variance(line.gain * grey + line.offset);
  }
};

/// Inverse variances by light in whole grey values of the first exposure: of every exposure one row.
using Weights = std::vector<std::array<double, 4 * kLevels>>;

Weights weights_of(const std::vector<Table>& tables, const NoiseModel& noise) {
  Weights weights(tables.size());
  for (std::size_t i = 0; i < tables.size(); ++i) {
    for (std::size_t grey = 0; grey < weights[i].size(); ++grey)
      weights[i][grey] = tables[i].weight(static_cast<double>(grey), noise);
  }
  return weights;
}

}  // namespace

ExposureLine line_between(const cv::Mat& first, const OtherExposure& other, double black) {
  // Of the shorter one the mean at each value of the longer one, whose noise is the smaller part of it.
  const bool is_longer = other.factor > 1.0;
  const cv::Mat &longer = is_longer ? other.image : first, &shorter = is_longer ? first : other.image;
  std::array<double, kLevels> sum{};
  std::array<int, kLevels> count{};
  for (int y = 0; y < first.rows; ++y) {
    const auto *l = longer.ptr<uchar>(y), *s = shorter.ptr<uchar>(y);
    for (int x = 0; x < first.cols * first.channels(); ++x) sum[l[x]] += s[x], ++count[l[x]];
  }
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  int levels = 0;
  for (int grey = kFitFrom; grey <= kFitTo; ++grey) {
    if (count[grey] < kMinPixels || sum[grey] < kMinMean * count[grey]) continue;
    const double mean = sum[grey] / count[grey], w = std::sqrt(count[grey]);  // dark levels have nearly all pixels
    n += w, x += w * grey, y += w * mean, xx += w * grey * grey, xy += w * grey * mean;
    ++levels;
  }
  const double spread = n * xx - x * x, gain = (n * xy - x * y) / spread;
  if (levels < kMinLevels || !(gain > 0.0)) return {other.factor, black * (1.0 - other.factor)};
  const double offset = (y - gain * x) / n;
  return is_longer ? ExposureLine{1.0 / gain, -offset / gain} : ExposureLine{gain, offset};
}

cv::Mat merge_exposures(const cv::Mat& first, std::span<const OtherExposure> others, const NoiseModel& noise) {
  assert(first.depth() == CV_8U);
  std::vector<Table> tables{Table({})};
  std::vector<cv::Mat> images{first};
  for (const OtherExposure& other : others) {
    assert(other.image.size() == first.size() && other.image.type() == first.type());
    tables.emplace_back(line_between(first, other, noise.black));
    images.push_back(other.image);
  }
  const auto by_gain = [](const Table& a, const Table& b) { return a.line.gain < b.line.gain; };
  const auto shortest =
      static_cast<std::size_t>(std::min_element(tables.begin(), tables.end(), by_gain) - tables.begin());
  const Weights weights = weights_of(tables, noise);
  cv::Mat merged(first.size(), CV_16UC(first.channels()));
  parallel_for(static_cast<std::size_t>(first.rows), [&](std::size_t row) {
    const int y = static_cast<int>(row), width = first.cols * first.channels();
    std::vector<const uchar*> in;
    for (const cv::Mat& image : images) in.push_back(image.ptr<uchar>(y));
    auto* out = merged.ptr<ushort>(y);
    for (int x = 0; x < width; ++x) {
      // The variance of each is that of the light that the most sensitive of them shows: its own noise would choose.
      double light = tables[shortest].value[in[shortest][x]], gain = 0.0;
      for (std::size_t i = 0; i < tables.size(); ++i) {
        const uchar grey = in[i][x];
        if (tables[i].trust[grey] < 1.0 || tables[i].line.gain <= gain) continue;
        gain = tables[i].line.gain, light = tables[i].value[grey];
      }
      const auto level = static_cast<std::size_t>(std::clamp(std::lround(light), 0L, 4L * kLevels - 1));
      double sum = 0.0, weight = 0.0;
      for (std::size_t i = 0; i < tables.size(); ++i) {
        const uchar grey = in[i][x];
        const double w = weights[i][level] * tables[i].trust[grey];
        sum += w * tables[i].value[grey], weight += w;
      }
      const double mean = weight > 0.0 ? sum / weight : tables[shortest].value[in[shortest][x]];
      out[x] =
          static_cast<ushort>(std::clamp(std::lround(kMergedUnitsPerGrey * mean), 0L, static_cast<long>(kMaxValue)));
    }
  });
  return merged;
}

}  // namespace scanrig
