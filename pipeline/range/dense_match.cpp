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

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Noise of neighbouring pixels is correlated (demosaicing, resampling), so that the residual shows too little of it:
// found from known truth, see README.md. The smoothing's own share is sqrt(4 pi) times its width.
constexpr float kSharpInflation = 1.7f;
constexpr float kSmoothInflation = 2.5f;
constexpr std::uint8_t kSharpRadius = 7;  // px
constexpr float kTilt = 0.6f;             // px of disparity a px at which sigma has grown by 1.4
constexpr float kConfidence = 3.0f;       // standard deviations
constexpr double kSmoothing = 0.7;        // px, of the larger windows' images

cv::Mat1f smoothed(const cv::Mat1f& image) {
  cv::Mat1f out;
  cv::GaussianBlur(image, out, {7, 7}, kSmoothing, kSmoothing, cv::BORDER_REPLICATE);
  return out;
}

/// One image of the pair, as it is for windows of good signal, smoothed for large windows where noise rules.
struct LayeredImage {
  explicit LayeredImage(const cv::Mat1f& image) : sharp(image), smooth(smoothed(image)) {}
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
DisparityPatch plane_patch(const cv::Mat1f& coarse, int u, int v) {
  constexpr int kReach = 6;
  constexpr float kSame = 4.0f;  // px; slopes reach 0.7 px a px
  DisparityPatch patch;
  const float centre = coarse(v, u);
  if (std::isnan(centre)) return patch;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (int y = std::max(0, v - kReach); y <= std::min(coarse.rows - 1, v + kReach); ++y) {
    for (int x = std::max(0, u - kReach); x <= std::min(coarse.cols - 1, u + kReach); ++x) {
      const float d = coarse(y, x);
      if (!(std::abs(d - centre) < kSame)) continue;
      const Eigen::Vector3d row(1.0, x - u, y - v);
      normal += row * row.transpose();
      rhs += row * static_cast<double>(d - centre);
    }
  }
  if (normal(0, 0) < 30.0) return patch;
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
           static_cast<double>(patch.sigma) <= options.largest_sigma_px;
  }

  /// Whether a larger window's answer is one that the smaller window's noise explains.
  static bool compatible(const DisparityPatch& small, const DisparityPatch& large) {
    const float spread = std::sqrt(std::max(0.0f, small.sigma * small.sigma - large.sigma * large.sigma));
    return std::abs(small.c[0] - large.c[0]) <= kConfidence * spread;
  }

  [[nodiscard]] DisparityPatch match_sharp(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                           int iterations) const {
    WindowOptions window;
    window.iterations = iterations;
    patch.radius = radius;
    patch = match_window(here.sharp, there.sharp, mask, u, v, patch, window);
    patch.sigma *= kSharpInflation;
    return patch;
  }

  [[nodiscard]] DisparityPatch match_smooth(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                            int iterations) const {
    WindowOptions window;
    window.iterations = iterations;
    window.curvature_prior = 0.15f;
    window.step_px = 1.5f;  // where the signal is low the coarse disparities are worse too
    patch.radius = radius;
    patch = match_window(here.smooth, there.smooth, mask, u, v, patch, window);
    patch.sigma *= kSmoothInflation;
    return patch;
  }

  /// Matches with the window that suits signal and shape: the smaller of two sharp ones where the larger one's answer
  /// is outside its confidence (a crease, a step: the rule of intersecting confidence intervals [Katkovnik 1999]),
  /// large smoothed ones where the signal is low.
  [[nodiscard]] DisparityPatch match(int u, int v, const DisparityPatch& start, int iterations) const {
    DisparityPatch best = match_sharp(u, v, start, kSharpRadius, iterations);
    const DisparityPatch small = match_sharp(u, v, best.valid ? best : start, 5, iterations);
    if (good(small) && (!good(best) || !compatible(small, best))) best = small;
    if (good(best) && double(best.sigma) <= options.enough_sigma_px) return best;
    for (const std::uint8_t radius : {std::uint8_t{10}, std::uint8_t{15}}) {
      const DisparityPatch large = match_smooth(u, v, best.valid ? best : start, radius, iterations);
      if (!good(large) || (good(best) && (large.sigma >= best.sigma || !compatible(best, large)))) continue;
      best = large;
      if (double(best.sigma) <= options.enough_sigma_px) break;
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
        const DisparityPatch start = plane_patch(mask.disparity, u, v);
        if (start.valid) nodes.at(column, row) = match(u, v, start, 10);
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
    if (start.valid) return match(u, v, start, 6);
    start = plane_patch(mask.disparity, u, v);
    return start.valid ? match(u, v, start, 10) : start;
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

/// Disparities that the other image's disparities confirm; what only one camera sees goes. `towards`: -1 left to right.
cv::Mat1f confirmed(const cv::Mat1f& here, const cv::Mat1f& there, float towards) {
  constexpr float kTolerance = 1.5f;  // px
  cv::Mat1f out(here.size(), kNaN);
  for (int v = 0; v < here.rows; ++v) {
    for (int u = 0; u < here.cols; ++u) {
      const float d = here(v, u);
      if (std::isnan(d)) continue;
      const int landing = static_cast<int>(std::lround(static_cast<float>(u) + towards * d));
      if (landing >= 0 && landing < here.cols && std::abs(there(v, landing) - d) <= kTolerance) out(v, u) = d;
    }
  }
  return out;
}

cv::Mat1b everywhere(const cv::Mat1b& mask, cv::Size size) { return mask.empty() ? cv::Mat1b(size, 255) : mask; }

}  // namespace

Result<DenseDisparity> dense_disparity(const RectifiedPair& pair, const CoarseDisparity& coarse,
                                       const StereoOptions& options, const Context& context) {
  const cv::Size size = pair.left.size();
  const LayeredImage left(pair.left), right(pair.right);
  const cv::Mat1f coarse_left = confirmed(coarse.left, coarse.right, -1.0f);
  cv::Mat1f coarse_right = confirmed(coarse.right, coarse.left, 1.0f);
  coarse_right *= -1.0f;  // u_right - u_left, seen from the right
  const MatchMask left_mask{everywhere(pair.left_object, size), coarse_left};
  const MatchMask right_mask{everywhere(pair.right_object, size), coarse_right};
  const Side forward{left, right, left_mask, options}, backward{right, left, right_mask, options};
  const Nodes back = backward.match_nodes(3, context);
  context.report("range", 0.4);
  const Nodes nodes = forward.match_nodes(4, context);
  context.report("range", 0.6);

  DenseDisparity out{cv::Mat1f(size, kNaN), cv::Mat1f(size, kNaN), cv::Mat2f(size, cv::Vec2f(kNaN, kNaN))};
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    if (context.stopped()) return;
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      if (left_mask.usable(v, u) == 0) continue;
      const DisparityPatch patch = forward.match_pixel(nodes, u, v);
      if (!patch.valid || !points_back(patch, u, v, back, std::max(options.left_right_px, 3.0 * patch.sigma))) continue;
      out.value(v, u) = patch.c[0];
      // Tilted away, the two windows differ by more than the model knows: found from known truth, see README.md.
      out.sigma(v, u) = patch.sigma * std::hypot(1.0f, patch.c[1] / kTilt, patch.c[2] / kTilt);
      out.slope(v, u) = {patch.c[1], patch.c[2]};
    }
  });
  if (context.stopped()) return fail(ErrorCode::stopped, "range: stopped while matching");
  return out;
}

namespace {

/// What the neighbours in eight directions say about a pixel. Those beyond a depth step see another surface and have no
/// say; but a pixel right beside a step may belong to either side.
struct Neighbours {
  int seen = 0;
  int agreeing = 0;
  bool at_step = false;
};

Neighbours ask_neighbours(const DenseDisparity& disparity, int u, int v, const StereoOptions& options) {
  constexpr int kBeside = 2, kApart = 4;  // px
  constexpr double kStep = 1.5;           // px of disparity
  const cv::Size size = disparity.value.size();
  const float d = disparity.value(v, u);
  Neighbours answer;
  for (const int apart : {kBeside, kApart}) {
    for (int dy = -apart; dy <= apart; dy += apart) {
      for (int dx = -apart; dx <= apart; dx += apart) {
        const int x = u + dx, y = v + dy;
        if ((dx == 0 && dy == 0) || x < 0 || y < 0 || x >= size.width || y >= size.height) continue;
        if (std::isnan(disparity.value(y, x))) continue;
        const cv::Vec2f slope = 0.5f * (disparity.slope(y, x) + disparity.slope(v, u));
        const float predicted =
            disparity.value(y, x) - slope[0] * static_cast<float>(dx) - slope[1] * static_cast<float>(dy);
        const double off = static_cast<double>(std::abs(predicted - d));
        const bool beyond_step = off > kStep;
        if (apart == kBeside) answer.at_step |= beyond_step;
        if (apart == kBeside || beyond_step) continue;
        const double sigma = static_cast<double>(std::max(disparity.sigma(v, u), disparity.sigma(y, x)));
        ++answer.seen;
        if (off <= std::max(options.neighbour_px, 3.0 * sigma)) ++answer.agreeing;
      }
    }
  }
  return answer;
}

}  // namespace

void remove_outliers(DenseDisparity& disparity, const StereoOptions& options) {
  constexpr int kMinAgreeing = 3;  // of 8: one side of a corner
  const cv::Size size = disparity.value.size();
  cv::Mat1s kept(size, short{0});
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < size.width; ++u) {
      if (std::isnan(disparity.value(v, u))) continue;
      const Neighbours n = ask_neighbours(disparity, u, v, options);
      if (n.at_step || n.agreeing < kMinAgreeing || 4 * n.agreeing < 3 * n.seen) continue;
      // Disparity in 1/16 px, offset so that 0 stays "nothing".
      kept(v, u) = cv::saturate_cast<short>(16000.0f + 16.0f * disparity.value(v, u));
    }
  });
  cv::filterSpeckles(kept, 0.0, options.smallest_patch_px, 16.0);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      if (kept(v, u) != 0) continue;
      disparity.value(v, u) = disparity.sigma(v, u) = kNaN;
      disparity.slope(v, u) = {kNaN, kNaN};
    }
  }
}

}  // namespace scanrig
