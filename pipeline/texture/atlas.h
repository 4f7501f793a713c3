#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/texture/chart_cutting.h"

namespace scanrig {

/// Place of every face in the atlas. Texel centres are at integer coordinates here.
struct AtlasLayout {
  double texels_per_px = 0.0;
  std::vector<std::array<Eigen::Vector2d, 3>> corners;  ///< one per face, texels
  cv::Mat1i owner;  ///< the face whose plane colours a texel, padding included; -1: none. Down to the last chart
  int padding_px = 0;
  std::vector<std::uint8_t> is_padded;  ///< one per face: 1 if it owns texels beyond itself

  /// The texels among which are all that a face owns.
  [[nodiscard]] cv::Rect box_of(std::size_t face) const;
};

/// Packs the charts' projections into a square of `atlas_px`, at the largest scale up to `max_texels_per_px` that fits;
/// nothing if none does. Where two faces of a chart overlap, the one nearer to the view owns the texel.
std::optional<AtlasLayout> lay_out(const Mesh& mesh, std::span<const ChartView> views, std::span<const Chart> charts,
                                   int atlas_px, double max_texels_per_px, int padding_px);

/// Barycentric weights of `at` in the triangle `corners`; nothing for a triangle without area.
std::optional<Eigen::Vector3d> barycentric(const std::array<Eigen::Vector2d, 3>& corners, const Eigen::Vector2d& at);

}  // namespace scanrig
