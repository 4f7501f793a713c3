#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "pipeline/texture/photo_looks.h"

namespace scanrig {

/// The paint of a point: its colour in the photos with the rig's light taken out.
struct PointColour {
  Eigen::Vector3f bgr = Eigen::Vector3f::Zero();  ///< linear, 1 = the sensor's full scale under mean light
  float weight = 0.0F;                            ///< of all photos together; 0: no photo sees the point
};

/// What one photo gives for the paint of a point.
struct PaintSample {
  Eigen::Vector3f bgr;  ///< linear, the rig's light taken out
  float weight;
};
/// `pixel` as of PhotoLook, `weight` of the photo there, `light` on the point.
PaintSample paint_in(const PhotoView& view, const Eigen::Vector2f& pixel, float weight, const Eigen::Vector3f& light,
                     const BlendOptions& options);

/// The colour that most weight agrees on: photos that disagree with the majority (highlights, shadows, an occlusion)
/// lose weight. Without samples weight 0.
PointColour majority(std::span<const PaintSample> samples, const BlendOptions& options);

/// The same of all photos that see a point, as looked up before.
PointColour blend_looks(std::span<const PhotoView> views, std::span<const PhotoLook> looks,
                        const BlendOptions& options);

/// Blends all photos that see `point` with unit `normal` (model frame, mm) by majority(). Continuous over the surface.
PointColour blend_photos(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal, const BlendOptions& options);

/// Light of the rig from an even choice of the mesh's vertices; `normals` unit, one per vertex.
RigLight light_from_photos(std::span<const PhotoView> views, const Mesh& mesh,
                           const std::vector<Eigen::Vector3f>& normals, const BlendOptions& options);

/// Gives the unseen vertices (weight 0) the colour of the surface around them.
void fill_unseen(const Mesh& mesh, int rounds, std::vector<PointColour>& colours);

}  // namespace scanrig
