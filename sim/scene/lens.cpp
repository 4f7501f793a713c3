#include "sim/scene/lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "sim/scene/image_sensor.h"

namespace scanrig::sim {
namespace {

constexpr int kMaxReach = 16;  // px

/// A Gaussian exp(-(xx dx^2 + 2 xy dx dy + yy dy^2) / 2) around (x, y).
struct Spot {
  double x, y, xx, xy, yy, reach;
};

/// Weighted mean of one channel under the spot. The mixed term is a product of powers: two exponentials a row and a
/// column, not one a pixel.
float mean_under(const cv::Mat& light, const Spot& s, int channel) {
  const int cx = static_cast<int>(std::lround(s.x)), cy = static_cast<int>(std::lround(s.y));
  const int reach = std::min(kMaxReach, static_cast<int>(std::ceil(s.reach)));
  const double ox = s.x - cx, oy = s.y - cy;
  std::array<float, 2 * kMaxReach + 1> along{};
  for (int i = -reach; i <= reach; ++i)
    along[i + reach] = static_cast<float>(std::exp(-0.5 * s.xx * (i - ox) * (i - ox)));
  double sum = 0.0, total = 0.0;
  for (int j = -reach; j <= reach; ++j) {
    const double dy = j - oy;
    const auto* row = light.ptr<cv::Vec3f>(std::clamp(cy + j, 0, light.rows - 1));
    const auto step = static_cast<float>(std::exp(-s.xy * dy));
    auto mixed = static_cast<float>(std::exp(s.xy * dy * (reach + ox)));  // at i = -reach
    float row_sum = 0.0F, row_total = 0.0F;
    for (int i = -reach; i <= reach; ++i, mixed *= step) {
      const float weight = along[i + reach] * mixed;
      row_sum += weight * row[std::clamp(cx + i, 0, light.cols - 1)][channel];
      row_total += weight;
    }
    const double down = std::exp(-0.5 * s.yy * dy * dy);
    sum += down * row_sum, total += down * row_total;
  }
  return static_cast<float>(sum / total);
}

/// A Gaussian sampled at whole pixels is narrower than it should be, by its first harmonic (Poisson's sum); the sigma
/// that has the right variance as sampled.
double sampled(double sigma) {
  const double wanted = sigma * sigma, turn = std::numbers::pi * std::numbers::pi;
  double variance = wanted;
  for (int i = 0; i < 4; ++i) variance = wanted + 8.0 * turn * variance * variance * std::exp(-2.0 * turn * variance);
  return std::sqrt(variance);
}

}  // namespace

Lens::Lens(const Effects& effects, bool is_left, double image_scale)
    : scale_(image_scale), astigmatism_(effects.astigmatism), chromatic_(effects.chromatic_px) {
  const double own = 1.0 + (is_left ? -0.5 : 0.5) * effects.lens_difference;
  centre_ = own * effects.blur_centre_px, corner_ = own * effects.blur_corner_px;
}

Lens::Blur Lens::blur(double off) const {
  const double mean = centre_ + off * (corner_ - centre_), apart = std::sqrt(1.0 + off * (astigmatism_ - 1.0));
  return {mean * apart, mean / apart};
}

cv::Mat Lens::image(const cv::Mat& light, double extra_sigma_px) const {
  const bool is_even = centre_ == corner_ && astigmatism_ == 1.0 && chromatic_ == 0.0;
  if (is_even) return through_lens(light, scale_, extra_sigma_px, centre_);
  cv::Mat filtered(light.rows, light.cols, CV_32F);
  const double cx = 0.5 * (light.cols - 1), cy = 0.5 * (light.rows - 1), corner = std::hypot(cx, cy);
  parallel_for(static_cast<std::size_t>(light.rows), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    auto* out = filtered.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) {
      const int channel = (x & 1) + (y & 1);  // red, green or blue filter
      const double dx = x - cx, dy = y - cy, r2 = dx * dx + dy * dy, off = r2 / (corner * corner);
      const Blur b = blur(off);
      const double radial = sampled(scale_ * std::hypot(b.radial, extra_sigma_px)),
                   tangential = sampled(scale_ * std::hypot(b.tangential, extra_sigma_px));
      const double cc = r2 > 0.0 ? dx * dx / r2 : 1.0, ss = 1.0 - cc, cs = r2 > 0.0 ? dx * dy / r2 : 0.0;
      const double a = 1.0 / (radial * radial), t = 1.0 / (tangential * tangential);
      // A colour that is imaged larger comes from nearer the middle.
      const double shift = (channel - 1) * 0.5 * chromatic_ * scale_ / corner;
      out[x] = mean_under(light,
                          {x + shift * dx, y + shift * dy, a * cc + t * ss, (a - t) * cs, a * ss + t * cc,
                           3.3 * std::max(radial, tangential) + 0.5},
                          channel);
    }
  });
  return filtered;
}

}  // namespace scanrig::sim
