#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "pipeline/range/range_image.h"
#include "pipeline/volume/integrate.h"

namespace scanrig::test {

/// A solid given by its signed distance (mm, positive outside; exact or an underestimate of the true distance).
using Solid = std::function<double(const Eigen::Vector3d&)>;

Solid sphere(const Eigen::Vector3d& centre, double radius);
Solid box(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
Solid torus(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double ring, double tube);
/// The segment from a to b, `radius` thick.
Solid rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Upright, from y = low to y = high.
Solid cylinder(double x, double z, double low, double high, double radius);
Solid join(std::vector<Solid> parts);
Solid carve(Solid from, Solid what);
/// The solid moved: `to_from` takes the old place to the new one.
Solid moved(Solid solid, const Transform& to_from);

/// A turntable rig as in the project's default, on fewer pixels; images are exact except for the requested noise.
struct Rig {
  int width = 300, height = 225;
  double mm_per_pixel = 0.4;
  double elevation_deg = 22.0;
  int views = 8;
  double noise_mm = 0.0;    ///< of depth, one sigma, independent per pixel
  double dropouts = 0.0;    ///< share of measured pixels lost at random
  bool silhouettes = true;  ///< left and right, and the background in the range images
  bool stereo = true;       ///< only surface that right camera and projector see too is measured
  double max_incidence_deg = 70.0;
  unsigned seed = 1;
};

/// The first hit along a ray of unit direction: distance and outward normal.
struct Hit {
  double distance;
  Eigen::Vector3d normal;
};
using Cast = std::function<std::optional<Hit>(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;
Cast cast_into(Solid solid);

/// Views of a solid in the pose's turntable frame at angle 0.
std::vector<View> take_views(const Rig& rig, const Cast& cast);

/// An orthographic range image along `direction`, without background.
View take_orthographic(const Cast& cast, const Eigen::Vector3d& direction, const Eigen::Vector3d& centre,
                       double half_size_mm, double mm_per_pixel);

/// Distances of a mesh to the true solid, over its measured vertices (views >= 1).
struct Accuracy {
  double median = 0.0, p95 = 0.0, greatest = 0.0;  ///< mm
  double measured_share = 0.0;                     ///< of the vertices
  double greatest_closed = 0.0;                    ///< over the unmeasured vertices, mm
};
Accuracy accuracy(const Mesh& mesh, const Solid& solid);

}  // namespace scanrig::test
