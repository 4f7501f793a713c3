#include "pipeline/range/noise_correlation.h"

#include <array>
#include <cmath>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr int kReach = 4;  // px, of correlated noise: demosaicing, cubic splines and light smoothing stay within
constexpr int kLags = (2 * kReach + 1) * (kReach + 1);
constexpr std::size_t kMinPixels = 20;

/// Autocovariances at shifts (-reach..reach, 0..reach), over pairs that are both used.
struct Lags {
  std::array<double, kLags> residual{}, slope{}, pairs{};

  static std::size_t index(int dx, int dy) {
    const int i = dy * (2 * kReach + 1) + dx + kReach;
    return static_cast<std::size_t>(i);
  }
};

Lags lags_of(const WindowResidual& window) {
  Lags lags;
  const int side = window.side;
  for (int dy = 0; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      double residual = 0.0, slope = 0.0, pairs = 0.0;
      for (int y = 0; y + dy < side; ++y) {
        for (int x = std::max(0, -dx); x < std::min(side, side - dx); ++x) {
          const int first = y * side + x, second = first + dy * side + dx;
          const auto a = static_cast<std::size_t>(first), b = static_cast<std::size_t>(second);
          if (window.used[a] == 0 || window.used[b] == 0) continue;
          residual += static_cast<double>(window.residual[a]) * static_cast<double>(window.residual[b]);
          slope += static_cast<double>(window.slope[a]) * static_cast<double>(window.slope[b]);
          pairs += 1.0;
        }
      }
      const std::size_t i = Lags::index(dx, dy);
      lags.residual[i] = residual;
      lags.slope[i] = slope;
      lags.pairs[i] = pairs;
    }
  }
  return lags;
}

}  // namespace

float noise_correlation(const MatchImage& here, const MatchImage& there, const MatchMask& mask,
                        const std::vector<MatchedPixel>& pixels, const WindowOptions& options) {
  if (pixels.size() < kMinPixels) return 0.0F;
  std::vector<Lags> found(pixels.size());
  parallel_for(pixels.size(), [&](std::size_t i) {
    const MatchedPixel& pixel = pixels[i];
    found[i] = lags_of(window_residual(here, there, mask, pixel.at.x, pixel.at.y, pixel.patch, options));
  });
  // Each window counts by its own variances: bright and dark ones alike.
  Lags sum;
  const std::size_t zero = Lags::index(0, 0);
  for (const Lags& one : found) {
    if (!(one.residual[zero] > 0.0) || !(one.slope[zero] > 0.0)) continue;
    for (std::size_t i = 0; i < kLags; ++i) {
      sum.residual[i] += one.residual[i] / one.residual[zero] * one.pairs[zero];
      sum.slope[i] += one.slope[i] / one.slope[zero] * one.pairs[zero];
      sum.pairs[i] += one.pairs[i];
    }
  }
  double factor = 0.0;
  for (int dy = 0; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      if (dy == 0 && dx < 0) continue;
      const std::size_t i = Lags::index(dx, dy);
      if (!(sum.pairs[i] > 0.0)) continue;
      const double each = sum.residual[i] * sum.slope[i] / (sum.pairs[i] * sum.pairs[i]);
      factor += dx == 0 && dy == 0 ? each : 2.0 * each;
    }
  }
  return static_cast<float>(std::sqrt(std::max(0.0, factor)));
}

}  // namespace scanrig
