#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pipeline/range/range_image.h"

namespace scanrig {

/// A point of a measured surface and its tangent plane; the frame is stated at each use.
struct SurfacePoint {
  Eigen::Vector3d point;   ///< mm
  Eigen::Vector3d normal;  ///< unit, outward
  double sigma = 0.0;      ///< standard deviation along the normal, mm; never below 0.003
  double facing = 0.0;     ///< cosine of the angle between the normal and the direction to the camera
  int view = 0;            ///< index of the view that measured it
};

/// The range images of one pyramid level; level 0 shares the pixels of the input.
using RangeLevel = std::vector<RangeImage>;

/// The views' range images and `levels - 1` halvings of them. Depth and normals are averaged over 2x2 pixels of one
/// surface; a coarse pixel is NaN where fewer than two of its four are known.
std::vector<RangeLevel> range_pyramid(std::span<const View> views, int levels);

/// The surface at a sub-pixel position, bilinear, camera frame. Nothing where one of the four pixels is unknown or lies
/// on another surface.
std::optional<SurfacePoint> surface_at(const RangeImage& image, const Eigen::Vector2d& pixel);

/// The tangent plane of `image` nearest to `p` (both in its camera frame), by contractive projection: project `p`, drop
/// it on the tangent plane found there, project that foot, and so on [Park and Subbarao 2003, contractive projection
/// point]. Nothing where the sequence leaves the surface or does not settle.
std::optional<SurfacePoint> tangent_plane_near(const RangeImage& image, const Eigen::Vector3d& p);

/// About `count` points of one range image on a regular grid of pixels, camera frame; grazing ones (> 78 deg) left out.
std::vector<SurfacePoint> sample_image(const RangeImage& image, int count);

/// Points of all range images together, pose frame, one per cube of `spacing_mm`: the one seen most squarely.
std::vector<SurfacePoint> sample_surface(const RangeLevel& images, double spacing_mm);

/// Diagonal of the box around all measured points, pose frame, mm; 0 without points.
double measured_size(const RangeLevel& images);

}  // namespace scanrig
