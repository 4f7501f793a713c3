#include "pipeline/range/surface_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "pipeline/range/range_image.h"

namespace scanrig {
namespace {

constexpr int kRadius = 3;  // of the comparison, px
constexpr std::size_t kSurfaces = 3;
/// A farther node's surface must fit so much better: variances of 49 pixels differ by less in 19 of 20 (Fisher's F).
constexpr float kClearly = 1.6F;

/// A node's surface at a pixel (x, y) away.
struct SurfaceHere {
  const DisparityPatch* node;
  float x, y;
  float disparity;

  [[nodiscard]] DisparityPatch patch() const { return node->moved(x, y); }
};

/// The surfaces of the nodes around a pixel, nearest node first.
struct Surfaces {
  std::array<SurfaceHere, kSurfaces> found;
  std::size_t count = 0;

  void add(const DisparityPatch& node, float x, float y, float apart_px) {
    const float disparity = node.at(x, y);
    for (std::size_t i = 0; i < count; ++i) {
      if (std::abs(found[i].disparity - disparity) < apart_px) return;
    }
    if (count < kSurfaces) found[count++] = {&node, x, y, disparity};
  }
};

Surfaces surfaces_around(const Nodes& nodes, int u, int v, float apart_px) {
  Surfaces out;
  const int column = u / nodes.stride, row = v / nodes.stride;
  // The four nodes around the pixel come first, then the ring around these.
  for (const int ring : {0, 1}) {
    for (int y = std::max(0, row - ring); y <= std::min(nodes.rows - 1, row + 1 + ring); ++y) {
      for (int x = std::max(0, column - ring); x <= std::min(nodes.columns - 1, column + 1 + ring); ++x) {
        const bool is_inner = x >= column && x <= column + 1 && y >= row && y <= row + 1;
        const DisparityPatch& node = nodes.at(x, y);
        if (!node.valid || is_inner != (ring == 0)) continue;
        out.add(node, static_cast<float>(u - x * nodes.stride), static_cast<float>(v - y * nodes.stride), apart_px);
      }
    }
  }
  return out;
}

/// Mean square difference of both images around the pixel, less their means.
float misfit(const MatchImage& here, const MatchImage& there, const cv::Mat1b& usable, int u, int v,
             const DisparityPatch& patch) {
  float sum = 0.0F, squares = 0.0F, count = 0.0F;
  const int width = here.value.cols;
  for (int y = std::max(0, v - kRadius); y <= std::min(here.value.rows - 1, v + kRadius); ++y) {
    const float* cubic = there.cubic.row(y);
    for (int x = std::max(0, u - kRadius); x <= std::min(width - 1, u + kRadius); ++x) {
      if (usable(y, x) == 0) continue;
      const float at = static_cast<float>(x) - patch.at(static_cast<float>(x - u), static_cast<float>(y - v));
      if (at < 0.0F || at > static_cast<float>(width) - 1.001F) continue;
      const int column = static_cast<int>(at);
      const float t = at - static_cast<float>(column);
      const float* c = cubic + std::ptrdiff_t{4} * column;
      const float off = patch.gain * (c[0] + t * (c[1] + t * (c[2] + t * c[3]))) - here.value(y, x);
      sum += off;
      squares += off * off;
      count += 1.0F;
    }
  }
  constexpr float kFewest = 12.0F;
  if (count < kFewest) return std::numeric_limits<float>::infinity();
  return squares / count - sum * sum / (count * count);
}

}  // namespace

void assign_pixels(MatchMask& mask, const Nodes& nodes, const LayeredImage& here, const LayeredImage& there,
                   const StereoOptions& options) {
  const float apart_px = options.surface_px;
  cv::Mat1f assigned = mask.disparity.clone();
  parallel_for(static_cast<std::size_t>(assigned.rows), [&](std::size_t index) {
    const int v = static_cast<int>(index);
    for (int u = 0; u < assigned.cols; ++u) {
      if (mask.usable(v, u) == 0) continue;
      const Surfaces surfaces = surfaces_around(nodes, u, v, apart_px);
      if (surfaces.count == 0) continue;
      const float coarse = mask.disparity(v, u);
      if (surfaces.count == 1 && std::abs(coarse - surfaces.found[0].disparity) < apart_px) {
        assigned(v, u) = surfaces.found[0].disparity;
        continue;
      }
      const auto is_smooth = [&](const DisparityPatch& patch) { return patch.radius >= options.smooth_radii_px[0]; };
      const auto off_in = [&](bool smooth, const DisparityPatch& patch) {
        return misfit(smooth ? here.smooth : here.sharp, smooth ? there.smooth : there.sharp, mask.usable, u, v, patch);
      };
      // Surfaces are compared in one kind of image; a patch of poor residual must not win by it.
      const bool any_smooth = std::any_of(surfaces.found.begin(), surfaces.found.begin() + surfaces.count,
                                          [&](const SurfaceHere& surface) { return is_smooth(*surface.node); });
      float best = std::numeric_limits<float>::infinity();
      assigned(v, u) = kUnmeasured;
      for (std::size_t i = 0; i < surfaces.count; ++i) {
        const DisparityPatch patch = surfaces.found[i].patch();
        const float own = off_in(is_smooth(patch), patch);
        if (own > static_cast<float>(options.max_centre) * std::max(patch.residual, 1e-3F)) continue;
        const float off = is_smooth(patch) == any_smooth ? own : off_in(any_smooth, patch);
        if (kClearly * off >= best) continue;
        best = off;
        assigned(v, u) = patch.c[0];
      }
    }
  });
  mask.disparity = assigned;
}

}  // namespace scanrig
