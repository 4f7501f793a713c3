#include "sim/scene/dot_pattern.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

/// The mirrors: 1 where light passes. A mirror is on if its centre lies in a dot.
cv::Mat mirrors(double image_scale) {
  const Profile& p = profile();
  cv::Mat on = cv::Mat::zeros(p.projector_height, p.projector_width, CV_8U);
  // Projector pixels per camera pixel, at the aim point.
  const double camera_pixel = p.projector_focal_px /
                              std::hypot(p.distance_mm * std::sin(p.elevation_deg * CV_PI / 180) + p.projector_above_mm,
                                         p.distance_mm * std::cos(p.elevation_deg * CV_PI / 180)) *
                              p.distance_mm / (p.focal_px * image_scale);
  double mean_area = 0.0;
  for (int i = 0; i < 3; ++i) {
    mean_area += p.dot_shares[i] * CV_PI / 4.0 * std::pow(p.dot_diameters_px[i] * camera_pixel, 2.0);
  }
  // Dots fall independently and overlap: coverage = 1 - exp(-number * mean area / area).
  const double area = static_cast<double>(on.total());
  const auto number = static_cast<std::uint64_t>(-std::log(1.0 - p.dot_coverage) * area / mean_area);
  for (std::uint64_t i = 0; i < number; ++i) {
    const double u = uniform(mix(p.dot_seed, i, 1)) * on.cols, v = uniform(mix(p.dot_seed, i, 2)) * on.rows;
    const double kind = uniform(mix(p.dot_seed, i, 3));
    const int size = kind < p.dot_shares[0] ? 0 : kind < p.dot_shares[0] + p.dot_shares[1] ? 1 : 2;
    const double radius = 0.5 * p.dot_diameters_px[size] * camera_pixel;
    for (int y = std::max(0, static_cast<int>(v - radius)); y <= std::min(on.rows - 1.0, v + radius); ++y) {
      for (int x = std::max(0, static_cast<int>(u - radius)); x <= std::min(on.cols - 1.0, u + radius); ++x) {
        if ((x - u) * (x - u) + (y - v) * (y - v) <= radius * radius) on.at<std::uint8_t>(y, x) = 1;
      }
    }
  }
  return on;
}

}  // namespace

DotPattern::DotPattern(double image_scale) {
  cv::Mat on;
  mirrors(image_scale).convertTo(on, CV_32F, 60000.0);
  double per_pixel = 2.0, sigma = profile().projector_sigma_px;
  // Square mirrors without gaps, twice as finely sampled: nearest neighbour is exact.
  cv::resize(on, on, {}, per_pixel, per_pixel, cv::INTER_NEAREST);
  for (int level = 0; level < 9; ++level, sigma *= std::sqrt(2.0)) {
    if (sigma * per_pixel > 4.0 && per_pixel > 0.25) {
      // Blurred this far, half the samples are sufficient.
      cv::Mat half;
      cv::GaussianBlur(on, half, {}, 0.5);
      cv::resize(half, on, {}, 0.5, 0.5, cv::INTER_AREA);
      per_pixel *= 0.5;
    }
    cv::Mat blurred, samples;
    cv::GaussianBlur(on, blurred, {}, sigma * per_pixel, sigma * per_pixel, cv::BORDER_CONSTANT);
    blurred.convertTo(samples, CV_16U);
    levels_.push_back({sigma, per_pixel, samples});
  }
}

float DotPattern::brightness(double u, double v, double sigma) const {
  const auto sample = [&](const Level& level) {
    const double x = (u + 0.5) * level.per_pixel - 0.5, y = (v + 0.5) * level.per_pixel - 0.5;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    if (x0 < 0 || y0 < 0 || x0 + 1 >= level.samples.cols || y0 + 1 >= level.samples.rows) return 0.0F;
    const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    const auto* upper = level.samples.ptr<std::uint16_t>(y0) + x0;
    const auto* lower = level.samples.ptr<std::uint16_t>(y0 + 1) + x0;
    return (1.0F - fy) * ((1.0F - fx) * upper[0] + fx * upper[1]) + fy * ((1.0F - fx) * lower[0] + fx * lower[1]);
  };
  const double steps = 2.0 * std::log2(std::max(1.0, sigma / levels_.front().sigma));
  const double position = std::min(steps, static_cast<double>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(position);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  const auto share = static_cast<float>(position - static_cast<double>(fine));
  const float mixed =
      share > 0.0F ? (1.0F - share) * sample(levels_[fine]) + share * sample(levels_[coarse]) : sample(levels_[fine]);
  return mixed / 60000.0F;
}

}  // namespace scanrig::sim
