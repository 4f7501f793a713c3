#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig::sim {

/// Linear RGB as the profile writes it.
inline Eigen::Vector3f rgb(const double* c) { return Eigen::Map<const Eigen::Vector3d>(c).cast<float>(); }

/// A point of the object's surface to be coloured.
struct SurfacePoint {
  Eigen::Vector3d position;  ///< in the object's own frame, mm
  int triangle = 0;
  double u = 0.0;  ///< weights of the triangle's second and third corner
  double v = 0.0;
  double footprint_mm = 0.0;  ///< averaging width on the surface
};

/// Diffuse colour of an object. All implementations prefilter: details finer than the footprint are averaged, not
/// sampled. Colours are linear RGB albedo, limited to what a blue screen can key and a camera can measure
/// (`measurable`).
/// Threads: const functions from any.
class SurfaceColour {
 public:
  virtual ~SurfaceColour() = default;
  [[nodiscard]] virtual Eigen::Vector3f albedo(const SurfacePoint& point) const = 0;
};

/// Lightens albedo below 0.12, darkens albedo above 0.9, and limits blue to 1.1 times the stronger of red and green.
Eigen::Vector3f measurable(const Eigen::Vector3f& albedo);

/// Painted solid: coloured patches, stripes, spots and fine grain, all in space, with contrast everywhere.
std::unique_ptr<SurfaceColour> painted_colour();

/// Grey-brown stone with grain from 0.5 to 16 mm.
std::unique_ptr<SurfaceColour> stone_colour();

/// One colour per vertex (linear RGB), interpolated.
std::unique_ptr<SurfaceColour> vertex_colour(std::vector<Eigen::Vector3f> colours,
                                             std::vector<Eigen::Vector3i> triangles);

/// An image on the surface. `image`: 8 bit BGR, sRGB. `corners`: texture coordinates of each triangle's corners, (0,0)
/// at the lower left of the image, repeated outside [0,1]. `triangle_area_mm2`: for the footprint.
std::unique_ptr<SurfaceColour> image_colour(const cv::Mat& image, std::vector<std::array<Eigen::Vector2f, 3>> corners,
                                            const std::vector<double>& triangle_area_mm2);

}  // namespace scanrig::sim
