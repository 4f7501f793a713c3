#include "pipeline/characterise/dark_pattern.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/statistics.h"

namespace scanrig::flats {
namespace {

constexpr double kHotSigma = 6.0;             // one false pixel in 10^9
constexpr double kMadToSigma = 1.4826;        // of a normal distribution
constexpr std::size_t kMadSamples = 200'000;  // of the pixels

struct Mean {
  cv::Mat1f image;
  double clipped_share = 0.0;
};

Mean mean_of(const std::vector<const FlatPair*>& darks, const Linear& linear) {
  cv::Mat1d sum(darks.front()->first.size(), 0.0);
  double clipped = 0.0;
  for (const FlatPair* pair : darks) {
    for (const cv::Mat* raw : {&pair->first, &pair->second}) {
      cv::accumulate(linear(*raw), sum);
      clipped += static_cast<double>(raw->total()) - cv::countNonZero(*raw);
    }
  }
  const auto count = static_cast<double>(2 * darks.size());
  Mean mean;
  sum.convertTo(mean.image, CV_32F, 1.0 / count);
  mean.clipped_share = clipped / (count * static_cast<double>(sum.total()));
  return mean;
}

/// Sigma of most pixels, whatever the few are.
double robust_sigma(const cv::Mat1f& image) {
  const std::size_t step = std::max<std::size_t>(1, image.total() / kMadSamples);
  std::vector<double> sizes;
  for (std::size_t i = 0; i < image.total(); i += step) {
    sizes.push_back(std::abs(static_cast<double>(image(static_cast<int>(i / static_cast<std::size_t>(image.cols)),
                                                       static_cast<int>(i % static_cast<std::size_t>(image.cols))))));
  }
  return kMadToSigma * quantile(std::move(sizes), 0.5);
}

/// Puts the high-passed places together again.
cv::Mat1f high_passed(const cv::Mat1f& image, int window) {
  cv::Mat1f passed(image.size(), 0.0F);
  for (int place = 0; place < kPlaces; ++place) {
    const cv::Mat1f plane = high_pass(plane_of(image, place), window);
    for (int y = 0; y < plane.rows; ++y) {
      for (int x = 0; x < plane.cols; ++x) passed(2 * y + place / 2, 2 * x + place % 2) = plane(y, x);
    }
  }
  return passed;
}

/// Sigma of the offsets of columns, or of the rows of the transposed image: their means less local means. `noise`:
/// variance of a pixel of `mean` in time.
double line_sigma(const cv::Mat1f& mean, const cv::Mat1b& defects, int window, double noise) {
  cv::Mat1f lines(1, mean.cols);
  double variance_of_mean = 0.0;
  for (int x = 0; x < mean.cols; ++x) {
    double sum = 0.0;
    int count = 0;
    for (int y = 0; y < mean.rows; ++y) {
      if (defects(y, x) != 0) continue;
      sum += static_cast<double>(mean(y, x));
      ++count;
    }
    lines(0, x) = static_cast<float>(sum / std::max(count, 1));
    variance_of_mean += noise / std::max(count, 1) / mean.cols;
  }
  cv::Mat1f smooth;
  cv::blur(lines, smooth, {window, 1}, {-1, -1}, cv::BORDER_REFLECT_101);
  cv::Mat1f passed;
  cv::subtract(lines, smooth, passed);
  const double square = passed.dot(passed) / static_cast<double>(passed.total());
  return std::sqrt(std::max(0.0, square / (1.0 - 1.0 / window) - variance_of_mean));
}

}  // namespace

DarkPattern dark_pattern(const std::vector<const FlatPair*>& darks, const Linear& linear, int window) {
  DarkPattern dark;
  const Mean mean = mean_of(darks, linear);
  dark.clipped_share = mean.clipped_share;
  cv::Mat1f passed = high_passed(mean.image, window);
  const double sigma = robust_sigma(passed);
  dark.defects = cv::Mat1b(mean.image.size(), std::uint8_t{0});
  for (int y = 0; y < passed.rows; ++y) {
    for (int x = 0; x < passed.cols; ++x) {
      const double excess = static_cast<double>(passed(y, x));
      // Rounding alone may leave no sigma at all.
      if (excess < kHotSigma * std::max(sigma, std::sqrt(NoiseModel::kRounding))) continue;
      dark.hot_pixels.push_back({x, y, excess});
      dark.defects(y, x) = 1;
    }
  }
  std::ranges::stable_sort(dark.hot_pixels, [](const HotPixel& a, const HotPixel& b) { return a.excess > b.excess; });
  double variances = 0.0, pixels = 0.0, fixed = 0.0, grey = 0.0;
  for (const FlatPair* pair : darks) {
    for (const Tile& tile : tiles_of(*pair, linear, window, dark.defects)) {
      variances += tile.variance * tile.pixels;
      grey += tile.grey * tile.pixels;
      fixed += tile.fixed * tile.pixels;
      pixels += tile.pixels;
    }
  }
  dark.black = grey / pixels;
  dark.variance = variances / pixels;
  dark.dsnu = std::sqrt(std::max(0.0, fixed / pixels));
  const double noise_of_mean = dark.variance / static_cast<double>(2 * darks.size());
  dark.column = line_sigma(mean.image, dark.defects, window, noise_of_mean);
  cv::Mat1f turned;
  cv::Mat1b turned_defects;
  cv::transpose(mean.image, turned);
  cv::transpose(dark.defects, turned_defects);
  dark.row = line_sigma(turned, turned_defects, window, noise_of_mean);
  return dark;
}

}  // namespace scanrig::flats
