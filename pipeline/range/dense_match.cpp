#include "pipeline/range/dense_match.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/parallel.h"
#include "pipeline/range/window_match.h"

namespace scanrig {
namespace {

cv::Mat1f smoothed(const cv::Mat1f& image, double smoothing_px) {
  cv::Mat1f out;
  cv::GaussianBlur(image, out, {7, 7}, smoothing_px, smoothing_px, cv::BORDER_REPLICATE);
  return out;
}

/// One image of the pair: sharp for windows of good signal, smoothed for large windows where noise dominates.
struct LayeredImage {
  LayeredImage(const cv::Mat1f& image, double smoothing_px) : sharp(image), smooth(smoothed(image, smoothing_px)) {}
  MatchImage sharp, smooth;
};

/// Patches on a coarse grid of pixels.
struct Nodes {
  int stride = 1, columns = 0, rows = 0;
  std::vector<DisparityPatch> patches;

  Nodes(cv::Size size, int pixels_apart)
      : stride(pixels_apart),
        columns((size.width + stride - 1) / stride),
        rows((size.height + stride - 1) / stride),
        patches(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}
  [[nodiscard]] DisparityPatch& at(int column, int row) {
    return patches[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
  }
  [[nodiscard]] const DisparityPatch& at(int column, int row) const {
    return const_cast<Nodes*>(this)->at(column, row);
  }

  /// Calls visit(patch moved to (u, v)) for the valid nodes around it, nearest ring.
  template <class Visit>
  void around(int u, int v, const Visit& visit) const {
    const int left = u / stride, top = v / stride;
    for (int row = top; row <= std::min(top + 1, rows - 1); ++row) {
      for (int column = left; column <= std::min(left + 1, columns - 1); ++column) {
        const DisparityPatch& node = at(column, row);
        if (node.valid)
          visit(node.moved(static_cast<float>(u - column * stride), static_cast<float>(v - row * stride)));
      }
    }
  }
};

/// A plane through the coarse disparities around (u, v) that belong to the same surface as the pixel itself.
DisparityPatch plane_patch(const cv::Mat1f& coarse, int u, int v, const StereoOptions& options) {
  const int reach = options.plane_reach_px;
  DisparityPatch patch;
  const float centre = coarse(v, u);
  if (std::isnan(centre)) return patch;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (int y = std::max(0, v - reach); y <= std::min(coarse.rows - 1, v + reach); ++y) {
    for (int x = std::max(0, u - reach); x <= std::min(coarse.cols - 1, u + reach); ++x) {
      const float d = coarse(y, x);
      if (!(std::abs(d - centre) < options.plane_same_px)) continue;
      const Eigen::Vector3d row(1.0, x - u, y - v);
      normal += row * row.transpose();
      rhs += row * static_cast<double>(d - centre);
    }
  }
  if (normal(0, 0) < options.min_plane_pixels) return patch;
  const Eigen::Vector3d plane = normal.ldlt().solve(rhs);
  patch.c = {centre + static_cast<float>(plane[0]), static_cast<float>(plane[1]), static_cast<float>(plane[2])};
  patch.valid = std::abs(plane[0]) < 1.5 && std::abs(plane[1]) < 1.0;
  return patch;
}

/// One direction of matching.
struct Side {
  const LayeredImage& here;
  const LayeredImage& there;
  const MatchMask& mask;
  const StereoOptions& options;

  [[nodiscard]] bool good(const DisparityPatch& patch) const {
    return patch.valid && static_cast<double>(patch.zncc) >= options.min_zncc &&
           static_cast<double>(patch.sigma) <= options.max_sigma_px;
  }

  /// Whether the smaller window's noise explains a larger window's result.
  [[nodiscard]] bool compatible(const DisparityPatch& small, const DisparityPatch& large) const {
    const float spread = std::sqrt(std::max(0.0f, small.sigma * small.sigma - large.sigma * large.sigma));
    return std::abs(small.c[0] - large.c[0]) <= options.window_sigmas * spread;
  }

  [[nodiscard]] DisparityPatch match_sharp(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                           int max_iterations) const {
    WindowOptions window;
    window.max_iterations = max_iterations;
    patch.radius = radius;
    patch = match_window(here.sharp, there.sharp, mask, u, v, patch, window);
    patch.sigma *= options.sharp_inflation;
    return patch;
  }

  [[nodiscard]] DisparityPatch match_smooth(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                            int max_iterations) const {
    WindowOptions window;
    window.max_iterations = max_iterations;
    window.curvature_prior = options.smooth_curvature_prior;
    window.step_px = options.smooth_step_px;
    patch.radius = radius;
    patch = match_window(here.smooth, there.smooth, mask, u, v, patch, window);
    patch.sigma *= options.smooth_inflation;
    return patch;
  }

  /// Matches with the window that fits signal and shape. The smaller of two sharp ones where the larger one's result is
  /// outside its confidence (a crease, a step: the rule of intersecting confidence intervals [Katkovnik 1999]). Large
  /// smoothed ones where the signal is low.
  [[nodiscard]] DisparityPatch match(int u, int v, const DisparityPatch& start, int max_iterations) const {
    DisparityPatch best = match_sharp(u, v, start, options.sharp_radius_px, max_iterations);
    const DisparityPatch small = match_sharp(u, v, best.valid ? best : start, options.crease_radius_px, max_iterations);
    if (good(small) && (!good(best) || !compatible(small, best))) best = small;
    if (good(best) && double(best.sigma) <= options.good_sigma_px) return best;
    for (const std::uint8_t radius : options.smooth_radii_px) {
      const DisparityPatch large = match_smooth(u, v, best.valid ? best : start, radius, max_iterations);
      if (!good(large) || (good(best) && (large.sigma >= best.sigma || !compatible(best, large)))) continue;
      best = large;
      if (double(best.sigma) <= options.good_sigma_px) break;
    }
    best.valid = good(best);
    return best;
  }

  [[nodiscard]] Nodes match_nodes(int stride, const Context& context) const {
    Nodes nodes(mask.usable.size(), stride);
    parallel_for(static_cast<std::size_t>(nodes.rows), [&](std::size_t index) {
      if (context.stopped()) return;
      const int row = static_cast<int>(index);
      for (int column = 0; column < nodes.columns; ++column) {
        const int u = column * stride, v = row * stride;
        if (mask.usable(v, u) == 0) continue;
        const DisparityPatch start = plane_patch(mask.disparity, u, v, options);
        if (start.valid) nodes.at(column, row) = match(u, v, start, options.coarse_iterations);
      }
    });
    return nodes;
  }

  /// The patch at a pixel, from the node around it that correlates best, else from the coarse disparities.
  [[nodiscard]] DisparityPatch match_pixel(const Nodes& nodes, int u, int v) const {
    DisparityPatch start;
    nodes.around(u, v, [&](const DisparityPatch& patch) {
      if (!start.valid || patch.zncc > start.zncc) start = patch;
    });
    if (start.valid) return match(u, v, start, options.node_iterations);
    start = plane_patch(mask.disparity, u, v, options);
    return start.valid ? match(u, v, start, options.coarse_iterations) : start;
  }
};

/// Whether the nodes of the other image, where the patch points to, point back to it.
bool points_back(const DisparityPatch& patch, int u, int v, const Nodes& there, double tolerance) {
  const float landing = static_cast<float>(u) - patch.c[0];
  const int column = static_cast<int>(std::floor(landing));
  if (column < 0 || column >= there.columns * there.stride) return false;
  const float fraction = landing - static_cast<float>(column);
  float nearest = 1e9f;
  there.around(column, v, [&](const DisparityPatch& back) {
    nearest = std::min(nearest, std::abs(back.at(fraction, 0.0f) + patch.c[0]));
  });
  return static_cast<double>(nearest) <= tolerance;
}

/// Disparities that the other image's disparities confirm; surface seen by one camera only is removed. `towards`: -1
/// left to right.
cv::Mat1f confirmed(const cv::Mat1f& here, const cv::Mat1f& there, float towards, float tolerance_px) {
  cv::Mat1f out(here.size(), kUnmeasured);
  for (int v = 0; v < here.rows; ++v) {
    for (int u = 0; u < here.cols; ++u) {
      const float d = here(v, u);
      if (std::isnan(d)) continue;
      const int landing = static_cast<int>(std::lround(static_cast<float>(u) + towards * d));
      if (landing >= 0 && landing < here.cols && std::abs(there(v, landing) - d) <= tolerance_px) out(v, u) = d;
    }
  }
  return out;
}

cv::Mat1b everywhere(const cv::Mat1b& mask, cv::Size size) { return mask.empty() ? cv::Mat1b(size, 255) : mask; }

}  // namespace

Result<DenseDisparity> dense_disparity(const RectifiedPair& pair, const CoarseDisparity& coarse,
                                       const StereoOptions& options, const Context& context) {
  const cv::Size size = pair.left.size();
  const LayeredImage left(pair.left, options.smoothing_px), right(pair.right, options.smoothing_px);
  const cv::Mat1f coarse_left = confirmed(coarse.left, coarse.right, -1.0f, options.coarse_left_right_px);
  cv::Mat1f coarse_right = confirmed(coarse.right, coarse.left, 1.0f, options.coarse_left_right_px);
  coarse_right *= -1.0f;  // u_right - u_left, seen from the right
  const MatchMask left_mask{everywhere(pair.left_object, size), coarse_left};
  const MatchMask right_mask{everywhere(pair.right_object, size), coarse_right};
  const Side forward{left, right, left_mask, options}, backward{right, left, right_mask, options};
  const Nodes back = backward.match_nodes(options.right_node_stride_px, context);
  context.report("range", 0.4);
  const Nodes nodes = forward.match_nodes(options.left_node_stride_px, context);
  context.report("range", 0.6);

  DenseDisparity out{cv::Mat1f(size, kUnmeasured), cv::Mat1f(size, kUnmeasured),
                     cv::Mat2f(size, cv::Vec2f(kUnmeasured, kUnmeasured))};
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    if (context.stopped()) return;
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      if (left_mask.usable(v, u) == 0) continue;
      const DisparityPatch patch = forward.match_pixel(nodes, u, v);
      if (!patch.valid ||
          !points_back(patch, u, v, back, std::max(options.left_right_px, options.tolerance_sigmas * patch.sigma)))
        continue;
      out.value(v, u) = patch.c[0];
      // Tilted away, the two windows differ by more than the model covers: factor from known truth, see README.md.
      out.sigma(v, u) = patch.sigma * std::hypot(1.0f, patch.c[1] / options.tilt, patch.c[2] / options.tilt);
      out.slope(v, u) = {patch.c[1], patch.c[2]};
    }
  });
  if (context.stopped()) return fail(ErrorCode::stopped, "range: stopped while matching");
  return out;
}

namespace {

/// Agreement of the neighbours in eight directions with a pixel. Those beyond a depth step see another surface and do
/// not count; but a pixel right beside a step may belong to either side.
struct Neighbours {
  int seen = 0;
  int agreeing = 0;
  bool at_step = false;
};

Neighbours compare_with_neighbours(const DenseDisparity& disparity, int u, int v, const StereoOptions& options) {
  const cv::Size size = disparity.value.size();
  const float d = disparity.value(v, u);
  Neighbours result;
  for (const int apart : {options.beside_px, options.apart_px}) {
    for (int dy = -apart; dy <= apart; dy += apart) {
      for (int dx = -apart; dx <= apart; dx += apart) {
        const int x = u + dx, y = v + dy;
        if ((dx == 0 && dy == 0) || x < 0 || y < 0 || x >= size.width || y >= size.height) continue;
        if (std::isnan(disparity.value(y, x))) continue;
        const cv::Vec2f slope = 0.5f * (disparity.slope(y, x) + disparity.slope(v, u));
        const float predicted =
            disparity.value(y, x) - slope[0] * static_cast<float>(dx) - slope[1] * static_cast<float>(dy);
        const double off = static_cast<double>(std::abs(predicted - d));
        const bool beyond_step = off > options.step_px;
        if (apart == options.beside_px) result.at_step |= beyond_step;
        if (apart == options.beside_px || beyond_step) continue;
        const double sigma = static_cast<double>(std::max(disparity.sigma(v, u), disparity.sigma(y, x)));
        ++result.seen;
        if (off <= std::max(options.neighbour_px, options.tolerance_sigmas * sigma)) ++result.agreeing;
      }
    }
  }
  return result;
}

}  // namespace

void remove_outliers(DenseDisparity& disparity, const StereoOptions& options) {
  const cv::Size size = disparity.value.size();
  cv::Mat1s kept(size, short{0});
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      if (std::isnan(disparity.value(v, u))) continue;
      const Neighbours n = compare_with_neighbours(disparity, u, v, options);
      if (n.at_step || n.agreeing < options.min_agreeing || 4 * n.agreeing < 3 * n.seen) continue;
      // Disparity in 1/16 px, offset so that 0 stays "no disparity".
      kept(v, u) = cv::saturate_cast<short>(16000.0f + 16.0f * disparity.value(v, u));
    }
  });
  cv::filterSpeckles(kept, 0.0, options.min_patch_px, 16.0);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      if (kept(v, u) != 0) continue;
      disparity.value(v, u) = disparity.sigma(v, u) = kUnmeasured;
      disparity.slope(v, u) = {kUnmeasured, kUnmeasured};
    }
  }
}

}  // namespace scanrig
