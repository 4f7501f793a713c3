#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/texture/photo_looks.h"

namespace scanrig {

/// A direction along which a part of the surface is flattened: a photo's, without its distortion, or an axis.
struct ChartView {
  Projection projection;
  Transform view_from_model = Transform::Identity();

  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3f& point) const {
    return projection.project(view_from_model * point.cast<double>());
  }
  /// Cosine of the incidence on a face with unit `normal` at `point`.
  [[nodiscard]] double cosine(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
};

/// Connected faces flattened by one view.
struct Chart {
  std::uint16_t view = 0;
  std::vector<std::uint32_t> faces;  ///< ascending
};

/// The photos' views, then six orthographic ones along the axes for surface that no photo sees.
std::vector<ChartView> chart_views(std::span<const PhotoView> photos, double px_per_mm);

/// Cuts the surface into few charts. The photo that flattens a face decides its resolution, not its colour, so few
/// large charts are best: a greedy set cover picks the views, iterated conditional modes smooth the borders, small
/// charts join a neighbour where its view shows them. `looks`: of the mesh's vertices.
std::vector<Chart> cut_into_charts(const Mesh& mesh, std::span<const ChartView> views, std::size_t photos,
                                   const VertexLooks& looks, const ChartOptions& options);

}  // namespace scanrig
