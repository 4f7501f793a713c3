#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "pipeline/texture/texture.h"

namespace scanrig::testing {

struct Ball {
  Eigen::Vector3d centre;  ///< model frame, mm
  double radius;
};

/// Painted balls on the turntable under lamps that do not turn with it, photographed by formulae of its own: ray against
/// sphere, OpenCV's undistortion. Nothing of it is shared with the code under test.
struct PaintedScene {
  std::vector<Ball> balls;
  /// Linear BGR, 0..1, at a point of ball `index`.
  std::function<Eigen::Vector3d(std::size_t index, const Eigen::Vector3d& point)> paint;
  /// Brightness of white with this normal (turntable frame).
  std::function<double(const Eigen::Vector3d& normal)> lamps = [](const Eigen::Vector3d&) { return 1.0; };

  /// Triangles of about `edge` mm, vertices on the balls, no normals.
  [[nodiscard]] Mesh mesh(double edge) const;
  /// As a camera at the default rig's place takes it, table at `angle`; 4 x 4 rays a pixel.
  [[nodiscard]] Photo photo(const Camera& camera, double angle_rad) const;
};

/// A camera of the default rig at a share of its resolution: `azimuth` from the rig's middle, with lens distortion.
Camera rig_camera(double azimuth_rad, double elevation_rad, double image_scale);

/// Soft stripes in all directions and colours, finest period 3 mm.
Eigen::Vector3d striped(const Eigen::Vector3d& point);

/// `count` photos around the table by one camera.
std::vector<Photo> around(const PaintedScene& scene, const Camera& camera, int count);

}  // namespace scanrig::testing
