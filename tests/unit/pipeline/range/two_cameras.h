#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "pipeline/calibration/camera.h"

namespace scanrig::test {

/// Distance from `origin` (turntable frame, mm) along unit `direction` to the object, or nothing.
using Surface = std::function<std::optional<double>(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;

Surface ball(const Eigen::Vector3d& centre, double radius);
/// The upright strip of `width` (along x) and `height` around `centre`, facing +z.
Surface strip(const Eigen::Vector3d& centre, double width, double height);
/// The upright cylinder around (`x`, `z`), of any height.
Surface cylinder(double x, double z, double radius);
/// The disc around `centre` with unit `normal`.
Surface disc(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double radius);
Surface nearest_of(const Surface& a, const Surface& b);

/// The default rig of the design: f = 4266.7 px, 640 mm away, 22 deg above, baseline 160 mm, toed in; `size` pixels
/// around the line of sight to (0, 45, 0).
Calibration default_rig(cv::Size size);

struct Look {
  bool dots = true;                          ///< smooth random dots from a projector between the cameras
  double dot_light = 1.0;                    ///< of a dot, by the object's own
  double room_light = 0.35;                  ///< between dots
  double noise = 2.0;                        ///< grey levels
  Eigen::Vector3d screen = {150, 50, 20};    ///< BGR of what is not the object
  Eigen::Vector3d object = {120, 120, 120};  ///< BGR of the object between dots
  unsigned seed = 1;
};

/// The camera's image, BGR, 8 bit: every pixel the mean of 2x2 rays.
cv::Mat3b render(const Camera& camera, const Surface& surface, const Look& look);

/// z of the surface in a frame at the pixels of a projection; NaN where there is none.
cv::Mat1f true_depth(const Projection& projection, const Transform& frame_from_turntable, const Surface& surface);

}  // namespace scanrig::test
