#pragma once

#include <algorithm>
#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/context.h"
#include "pipeline/range/stereo.h"
#include "pipeline/range/window_match.h"

namespace scanrig {

/// One image of the pair: sharp for windows of good signal, smoothed for large windows where noise dominates.
struct LayeredImage {
  LayeredImage(const cv::Mat1f& image, double smoothing_px);
  MatchImage sharp, smooth;
};

/// Patches on a coarse grid of pixels.
struct Nodes {
  int stride = 1, columns = 0, rows = 0;
  std::vector<DisparityPatch> patches;
  std::vector<std::array<float, 3>> curvature;  ///< see node_curvature.h; empty: unknown

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

  [[nodiscard]] std::array<float, 3> curvature_at(const DisparityPatch& node) const {
    if (curvature.empty()) return {};
    return curvature[static_cast<std::size_t>(&node - patches.data())];
  }

  /// Calls visit(patch moved to (u, v), node) for the valid nodes around it, nearest ring.
  template <class Visit>
  void around(int u, int v, const Visit& visit) const {
    const int left = u / stride, top = v / stride;
    for (int row = top; row <= std::min(top + 1, rows - 1); ++row) {
      for (int column = left; column <= std::min(left + 1, columns - 1); ++column) {
        const DisparityPatch& node = at(column, row);
        if (node.valid)
          visit(node.moved(static_cast<float>(u - column * stride), static_cast<float>(v - row * stride)), node);
      }
    }
  }
};

/// By how much correlated noise widens sigma, see noise_correlation.h.
struct NoiseFactors {
  float sharp = 0.0F, smooth = 0.0F;
};

/// One direction of matching.
class MatchSide {
 public:
  /// All must live as long as this object. `mask` is completed by grow().
  MatchSide(const LayeredImage& here, const LayeredImage& there, MatchMask& mask, const StereoOptions& options)
      : here_(here),
        there_(there),
        mask_(mask),
        options_(options),
        factors_{options.sharp_noise, options.smooth_noise} {}

  /// From the images themselves; those of the options stay where too little is matched.
  void measure_noise();
  void set_noise(const NoiseFactors& factors) { factors_ = factors; }
  [[nodiscard]] const NoiseFactors& noise() const { return factors_; }

  /// Matches from coarse disparities.
  [[nodiscard]] Nodes match_nodes(int stride, const Context& context) const;
  /// Matches those that are not matched, with the mask as it is now.
  void rematch(Nodes& nodes, const Context& context) const;
  /// Gives pixels to the surfaces of matched nodes, see surface_labels.h.
  void assign(const Nodes& nodes);
  /// Matches nodes without coarse disparities from their neighbours, wave after wave; the mask takes their disparities.
  void grow(Nodes& nodes, const Context& context);
  /// The patch at a pixel, from the node around it on the same surface that correlates best, else from the mask's
  /// disparities; none for a pixel that no surface was given.
  [[nodiscard]] DisparityPatch match_pixel(const Nodes& nodes, int u, int v) const;

 private:
  [[nodiscard]] bool good(const DisparityPatch& patch) const;
  [[nodiscard]] DisparityPatch match_sharp(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                           WindowOptions window) const;
  [[nodiscard]] DisparityPatch match_smooth(int u, int v, DisparityPatch patch, std::uint8_t radius,
                                            WindowOptions window) const;
  [[nodiscard]] DisparityPatch match(int u, int v, const DisparityPatch& start, const WindowOptions& window) const;
  void fill_mask(const Nodes& nodes, int column, int row);

  const LayeredImage& here_;
  const LayeredImage& there_;
  MatchMask& mask_;
  const StereoOptions& options_;
  NoiseFactors factors_;
};

}  // namespace scanrig
