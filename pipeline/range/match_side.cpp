#include "pipeline/range/match_side.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "pipeline/range/noise_correlation.h"
#include "pipeline/range/surface_labels.h"

namespace scanrig {
namespace {

cv::Mat1f smoothed(const cv::Mat1f& image, double smoothing_px) {
  cv::Mat1f out;
  cv::GaussianBlur(image, out, {7, 7}, smoothing_px, smoothing_px, cv::BORDER_REPLICATE);
  return out;
}

/// Sums over the pixels of one surface around a pixel, column by column; y and disparities from the pixel's own.
struct PlaneSums {
  static constexpr int kReach = 6, kSide = 2 * kReach + 1;
  std::array<float, kSide> n{}, y{}, yy{}, d{}, yd{};

  void add_row(const float* disparity, int first, int last, float centre, float same_px, float row) {
    for (int k = first; k <= last; ++k) {
      const float off = disparity[k - kReach] - centre;
      const bool is_same = std::abs(off) < same_px;  // not NaN
      const auto i = static_cast<std::size_t>(k);
      const float one = is_same ? 1.0F : 0.0F, value = is_same ? off : 0.0F;
      n[i] += one;
      y[i] += row * one;
      yy[i] += row * row * one;
      d[i] += value;
      yd[i] += row * value;
    }
  }
};

/// A plane through the coarse disparities around (u, v) that belong to the same surface as the pixel itself.
DisparityPatch plane_patch(const cv::Mat1f& coarse, int u, int v, const StereoOptions& options) {
  constexpr int kReach = PlaneSums::kReach;
  DisparityPatch patch;
  const float centre = coarse(v, u);
  if (std::isnan(centre)) return patch;
  const int first = std::max(0, kReach - u), last = std::min(2 * kReach, coarse.cols - 1 - u + kReach);
  PlaneSums sums;
  for (int row = std::max(0, v - kReach); row <= std::min(coarse.rows - 1, v + kReach); ++row) {
    sums.add_row(coarse[row] + u, first, last, centre, options.plane_same_px, static_cast<float>(row - v));
  }
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (int k = first; k <= last; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double x = k - kReach, n = double(sums.n[i]), y = double(sums.y[i]), d = double(sums.d[i]);
    normal += (Eigen::Matrix3d() << n, x * n, y, x * n, x * x * n, x * y, y, x * y, double(sums.yy[i])).finished();
    rhs += Eigen::Vector3d(d, x * d, double(sums.yd[i]));
  }
  if (normal(0, 0) < options.min_plane_pixels) return patch;
  const Eigen::Vector3d plane = normal.ldlt().solve(rhs);
  patch.c = {centre + static_cast<float>(plane[0]), static_cast<float>(plane[1]), static_cast<float>(plane[2])};
  patch.valid = std::abs(plane[0]) < 1.5 && std::abs(plane[1]) < 1.0;
  return patch;
}

WindowOptions steps(int max_iterations) {
  WindowOptions window;
  window.max_iterations = max_iterations;
  return window;
}

/// Sigma with the noise that neighbouring pixels share, `factor` of noise_correlation.h. The fit's eight unknowns (six
/// of shape, gain, offset) also took part of that noise out of the residuals from which sigma is computed.
void add_shared_noise(DisparityPatch& patch, float factor) {
  constexpr float kUnknowns = 8.0F;
  const auto side = static_cast<float>(2 * patch.radius + 1);
  const float pixels = side * side / static_cast<float>(rows_apart(patch.radius));
  const float taken = std::min(0.5F, kUnknowns * factor * factor / pixels);
  patch.sigma *= factor / std::sqrt(1.0F - taken);
}

}  // namespace

LayeredImage::LayeredImage(const cv::Mat1f& image, double smoothing_px)
    : sharp(image), smooth(smoothed(image, smoothing_px)) {}

bool MatchSide::good(const DisparityPatch& patch) const {
  return patch.valid && static_cast<double>(patch.sigma) <= options_.max_sigma_px &&
         static_cast<double>(patch.centre) <= options_.max_centre;
}

DisparityPatch MatchSide::match_sharp(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                      WindowOptions window) const {
  patch.radius = radius;
  patch = match_window(here_.sharp, there_.sharp, mask_, u, v, patch, window);
  add_shared_noise(patch, factors_.sharp);
  return patch;
}

DisparityPatch MatchSide::match_smooth(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                       WindowOptions window) const {
  window.curvature_prior = options_.smooth_curvature_prior;
  window.step_px = options_.smooth_step_px;
  patch.radius = radius;
  patch = match_window(here_.smooth, there_.smooth, mask_, u, v, patch, window);
  add_shared_noise(patch, factors_.smooth);
  return patch;
}

/// Matches with the smallest window whose signal suffices, else with the most certain one. Large ones on smoothed
/// images: they begin where noise dominates.
DisparityPatch MatchSide::match(int u, int v, const DisparityPatch& start, const WindowOptions& window) const {
  DisparityPatch best, from = start;
  // Whether the window's result suffices.
  const auto take = [&](const DisparityPatch& patch) {
    if (patch.valid && !best.valid) from = patch;
    if (good(patch) && (!best.valid || patch.sigma < best.sigma)) from = best = patch;
    return best.valid && static_cast<double>(best.sigma) <= options_.good_sigma_px;
  };
  for (const std::uint8_t radius : options_.sharp_radii_px) {
    if (take(match_sharp(u, v, from, radius, window))) return best;
  }
  for (const std::uint8_t radius : options_.smooth_radii_px) {
    if (take(match_smooth(u, v, from, radius, window))) break;
  }
  return best;
}

void MatchSide::measure_noise() {
  constexpr int kSamples = 400, kColumns = 32;
  // One pixel of each cell of a grid, those with coarse disparities.
  std::vector<cv::Point> places;
  const cv::Size size = mask_.usable.size();
  const int stride = std::max(4, size.width / (4 * kColumns));
  for (int v = stride / 2; v < size.height; v += stride) {
    for (int u = stride / 2; u < size.width; u += stride) {
      if (mask_.usable(v, u) != 0 && !std::isnan(mask_.disparity(v, u))) places.emplace_back(u, v);
    }
  }
  const std::size_t every = std::max<std::size_t>(1, places.size() / kSamples);
  std::vector<MatchedPixel> tried((places.size() + every - 1) / every);
  parallel_for(tried.size(), [&](std::size_t i) {
    const cv::Point at = places[i * every];
    tried[i].at = at;
    const DisparityPatch start = plane_patch(mask_.disparity, at.x, at.y, options_);
    if (start.valid)
      tried[i].patch =
          match_sharp(at.x, at.y, start, options_.sharp_radii_px.front(), steps(options_.coarse_iterations));
  });
  std::erase_if(tried, [](const MatchedPixel& pixel) { return !pixel.patch.valid; });
  // The better half by correlation: noise is what matched windows leave.
  std::stable_sort(tried.begin(), tried.end(),
                   [](const MatchedPixel& a, const MatchedPixel& b) { return a.patch.zncc > b.patch.zncc; });
  tried.resize((tried.size() + 1) / 2);
  const float sharp = noise_correlation(here_.sharp, there_.sharp, mask_, tried, {});
  for (MatchedPixel& pixel : tried) pixel.patch.radius = options_.smooth_radii_px.front();
  WindowOptions wide;
  wide.step_px = options_.smooth_step_px;
  const float smooth = noise_correlation(here_.smooth, there_.smooth, mask_, tried, wide);
  if (sharp > 0.0F) factors_.sharp = sharp;
  if (smooth > 0.0F) factors_.smooth = smooth;
}

Nodes MatchSide::match_nodes(int stride, const Context& context) const {
  Nodes nodes(mask_.usable.size(), stride);
  rematch(nodes, context);
  return nodes;
}

void MatchSide::assign(const Nodes& nodes) { assign_pixels(mask_, nodes, here_, there_, options_); }

void MatchSide::rematch(Nodes& nodes, const Context& context) const {
  const int stride = nodes.stride;
  parallel_for(static_cast<std::size_t>(nodes.rows), [&](std::size_t index) {
    if (context.stopped()) return;
    const int row = static_cast<int>(index);
    for (int column = 0; column < nodes.columns; ++column) {
      const int u = column * stride, v = row * stride;
      if (mask_.usable(v, u) == 0 || nodes.at(column, row).valid) continue;
      const DisparityPatch start = plane_patch(mask_.disparity, u, v, options_);
      if (start.valid) nodes.at(column, row) = match(u, v, start, steps(options_.coarse_iterations));
    }
  });
}

/// Unknown pixels nearer to this node than to others take its disparities.
void MatchSide::fill_mask(const Nodes& nodes, int column, int row) {
  const DisparityPatch& node = nodes.at(column, row);
  const int u = column * nodes.stride, v = row * nodes.stride, reach = (nodes.stride + 1) / 2;
  for (int y = std::max(0, v - reach); y <= std::min(mask_.disparity.rows - 1, v + reach); ++y) {
    for (int x = std::max(0, u - reach); x <= std::min(mask_.disparity.cols - 1, u + reach); ++x) {
      float& known = mask_.disparity(y, x);
      if (std::isnan(known)) known = node.at(static_cast<float>(x - u), static_cast<float>(y - v));
    }
  }
}

void MatchSide::grow(Nodes& nodes, const Context& context) {
  WindowOptions window = steps(options_.node_iterations);
  window.unknown_joins = true;
  const auto at = [&](int column, int row) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(nodes.columns) + static_cast<std::size_t>(column);
  };
  std::vector<std::uint8_t> fresh(nodes.patches.size());
  for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = nodes.patches[i].valid ? 1 : 0;
  for (bool any = true; any && !context.stopped();) {
    // Each wave starts from the nodes of the one before only, so that the order of work does not matter.
    std::vector<DisparityPatch> grown(nodes.patches.size());
    parallel_for(static_cast<std::size_t>(nodes.rows), [&](std::size_t index) {
      const int row = static_cast<int>(index);
      for (int column = 0; column < nodes.columns; ++column) {
        const int u = column * nodes.stride, v = row * nodes.stride;
        if (nodes.at(column, row).valid || mask_.usable(v, u) == 0) continue;
        DisparityPatch start;
        for (int y = std::max(0, row - 1); y <= std::min(nodes.rows - 1, row + 1); ++y) {
          for (int x = std::max(0, column - 1); x <= std::min(nodes.columns - 1, column + 1); ++x) {
            if (fresh[at(x, y)] == 0) continue;
            const DisparityPatch& node = nodes.at(x, y);
            if (start.valid && node.zncc <= start.zncc) continue;
            start = node.moved(static_cast<float>((column - x) * nodes.stride),
                               static_cast<float>((row - y) * nodes.stride));
          }
        }
        if (start.valid) grown[at(column, row)] = match(u, v, start, window);
      }
    });
    any = false;
    for (int row = 0; row < nodes.rows; ++row) {
      for (int column = 0; column < nodes.columns; ++column) {
        const std::size_t i = at(column, row);
        fresh[i] = grown[i].valid ? 1 : 0;
        if (!grown[i].valid) continue;
        nodes.at(column, row) = grown[i];
        fill_mask(nodes, column, row);
        any = true;
      }
    }
  }
}

DisparityPatch MatchSide::match_pixel(const Nodes& nodes, int u, int v) const {
  DisparityPatch start;
  const float surface = mask_.disparity(v, u);
  if (std::isnan(surface)) return start;
  WindowOptions window = steps(options_.node_iterations);
  nodes.around(u, v, [&](const DisparityPatch& patch, const DisparityPatch& node) {
    if (std::abs(patch.c[0] - surface) >= options_.surface_px) return;
    if (start.valid && patch.zncc <= start.zncc) return;
    start = patch;
    window.curvature = nodes.curvature_at(node);
  });
  if (start.valid) return match(u, v, start, window);
  start = plane_patch(mask_.disparity, u, v, options_);
  return start.valid ? match(u, v, start, steps(options_.coarse_iterations)) : start;
}

}  // namespace scanrig
