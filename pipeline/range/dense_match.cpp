#include "pipeline/range/dense_match.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "core/parallel.h"
#include "pipeline/range/match_side.h"
#include "pipeline/range/node_curvature.h"

namespace scanrig {
namespace {

/// Whether the nodes of the other image, where the patch points to, point back to it.
bool points_back(const DisparityPatch& patch, int u, int v, const Nodes& there, const StereoOptions& options) {
  const float landing = static_cast<float>(u) - patch.c[0];
  const int column = static_cast<int>(std::floor(landing));
  if (column < 0 || column >= there.columns * there.stride) return false;
  const float fraction = landing - static_cast<float>(column);
  const double tolerance = std::max(options.left_right_px, options.tolerance_sigmas * static_cast<double>(patch.sigma));
  bool is_confirmed = false;
  there.around(column, v, [&](const DisparityPatch& back, const DisparityPatch&) {
    is_confirmed |= static_cast<double>(std::abs(back.at(fraction, 0.0f) + patch.c[0])) <= tolerance;
  });
  return is_confirmed;
}

/// 1 on a lattice's line, falling to 0 at the next.
float nearness(int pixel, int line, int stride) {
  return 1.0F - static_cast<float>(std::abs(pixel - line)) / static_cast<float>(stride);
}

/// Pixels of the left image with the patch of their own surface.
struct MatchedPixels {
  const MatchSide& forward;
  const Nodes& nodes;
  const Nodes& back;
  const MatchMask& mask;
  const StereoOptions& options;

  /// Matched, and confirmed from the right image; else invalid.
  [[nodiscard]] DisparityPatch at(int u, int v) const {
    if (mask.usable(v, u) == 0) return {};
    DisparityPatch patch = forward.match_pixel(nodes, u, v);
    patch.valid = patch.valid && points_back(patch, u, v, back, options) && on_surface(patch, u, v);
    return patch;
  }

  /// From the matched pixels of a lattice around (u, v): their mean, weighted by nearness, where their surfaces meet in
  /// it; matched itself where they do not, or some are not matched; none where none is.
  [[nodiscard]] DisparityPatch at(const Nodes& lattice, int u, int v) const {
    const int stride = lattice.stride, column = u / stride, row = v / stride;
    const bool in_column = u % stride == 0, in_row = v % stride == 0;
    if (in_column && in_row) return lattice.at(column, row);
    DisparityPatch mean;
    const int last_column = column + (in_column ? 0 : 1), last_row = row + (in_row ? 0 : 1);
    if (mask.usable(v, u) == 0) return mean;
    if (last_column >= lattice.columns || last_row >= lattice.rows) return at(u, v);
    float least = std::numeric_limits<float>::infinity(), most = -least, shares = 0.0F;
    bool is_whole = true;
    int count = 0;
    for (int y = row; y <= last_row; ++y) {
      for (int x = column; x <= last_column; ++x) {
        const DisparityPatch& node = lattice.at(x, y);
        const bool is_beyond = mask.usable(y * stride, x * stride) == 0;  // off the object: nothing is missing there
        is_whole = is_whole && (node.valid || is_beyond);
        if (!node.valid) continue;
        ++count;
        const DisparityPatch patch = node.moved(static_cast<float>(u - x * stride), static_cast<float>(v - y * stride));
        const float share = nearness(u, x * stride, stride) * nearness(v, y * stride, stride);
        least = std::min(least, patch.c[0]);
        most = std::max(most, patch.c[0]);
        for (std::size_t i = 0; i < 3; ++i) mean.c[i] += share * patch.c[i];
        mean.sigma += share * patch.sigma;
        shares += share;
      }
    }
    if (shares == 0.0F) return mean;
    for (std::size_t i = 0; i < 3; ++i) mean.c[i] /= shares;
    mean.sigma /= shares;
    if (!is_whole || count < 2 ||
        most - least > std::min(options.lattice_agree_px, options.lattice_agree_sigmas * mean.sigma))
      return at(u, v);
    mean.valid = on_surface(mean, u, v);
    return mean;
  }

 private:
  /// A pixel on another surface than its window would be an extrapolation.
  [[nodiscard]] bool on_surface(const DisparityPatch& patch, int u, int v) const {
    return std::abs(patch.c[0] - mask.disparity(v, u)) < options.surface_px;
  }
};

/// One image in its box: what it is compared with, and which of its pixels with what disparity towards the other one.
struct BoxedSide {
  LayeredImage image;
  MatchMask mask;

  BoxedSide(const cv::Mat1f& whole, const cv::Mat1b& object, const cv::Mat1f& disparity, const cv::Rect& box,
            double smoothing_px)
      : image(whole(box).clone(), smoothing_px),
        mask{object.empty() ? cv::Mat1b(box.size(), 255) : object(box).clone(), disparity(box).clone()} {}
};

/// Matches every pixel of the lattice, then those between.
void match_pixels(const MatchedPixels& pixels, Nodes& lattice, const StereoOptions& options, DenseDisparity& out,
                  const Context& context) {
  parallel_for(static_cast<std::size_t>(lattice.rows), [&](std::size_t row) {
    if (context.stopped()) return;
    const int v = static_cast<int>(row) * lattice.stride;
    for (int column = 0; column < lattice.columns; ++column) {
      lattice.at(column, static_cast<int>(row)) = pixels.at(column * lattice.stride, v);
    }
  });
  context.report("range", 0.8);
  parallel_for(static_cast<std::size_t>(out.value.rows), [&](std::size_t row) {
    if (context.stopped()) return;
    const int v = static_cast<int>(row);
    for (int u = 0; u < out.value.cols; ++u) {
      const DisparityPatch patch = pixels.at(lattice, u, v);
      if (!patch.valid) continue;
      out.value(v, u) = patch.c[0];
      // Tilted away, the two windows differ by more than the model covers: factor from known truth, see README.md.
      out.sigma(v, u) = patch.sigma * std::hypot(1.0f, patch.c[1] / options.tilt, patch.c[2] / options.tilt);
      out.slope(v, u) = {patch.c[1], patch.c[2]};
    }
  });
}

}  // namespace

Result<DenseDisparity> dense_disparity(const RectifiedPair& pair, const CoarseDisparity& coarse, const PairBoxes& boxes,
                                       const StereoOptions& options, const Context& context) {
  const cv::Size size = pair.left.size();
  const cv::Mat1f sure_left = confirmed(coarse.left, coarse.right, -1.0f, options.coarse_left_right_px);
  const cv::Mat1f sure_right = confirmed(coarse.right, coarse.left, 1.0f, options.coarse_left_right_px);
  BoxedSide left(pair.left, pair.left_object, sure_left, boxes.left, options.smoothing_px);
  BoxedSide right(pair.right, pair.right_object, sure_right, boxes.right, options.smoothing_px);
  const auto shift = static_cast<float>(boxes.shift());
  left.mask.disparity -= shift;
  right.mask.disparity = shift - right.mask.disparity;  // u_right - u_left, seen from the right
  MatchSide forward(left.image, right.image, left.mask, options),
      backward(right.image, left.image, right.mask, options);
  forward.measure_noise();
  backward.set_noise(forward.noise());
  Nodes back = backward.match_nodes(options.right_node_stride_px, context);
  backward.grow(back, context);
  backward.assign(back);
  backward.rematch(back, context);
  context.report("range", 0.4);
  Nodes nodes = forward.match_nodes(options.left_node_stride_px, context);
  forward.grow(nodes, context);
  forward.assign(nodes);
  forward.rematch(nodes, context);
  nodes.curvature = node_curvature(nodes, options);
  context.report("range", 0.6);

  DenseDisparity out{cv::Mat1f(size, kUnmeasured), cv::Mat1f(size, kUnmeasured),
                     cv::Mat2f(size, cv::Vec2f(kUnmeasured, kUnmeasured))};
  DenseDisparity boxed{out.value(boxes.left), out.sigma(boxes.left), out.slope(boxes.left)};
  Nodes lattice(boxes.left.size(), options.lattice_px);
  match_pixels({forward, nodes, back, left.mask, options}, lattice, options, boxed, context);
  if (context.stopped()) return fail(ErrorCode::stopped, "range: stopped while matching");
  boxed.value += shift;
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
        const double sigma = static_cast<double>(std::hypot(disparity.sigma(v, u), disparity.sigma(y, x)));
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
