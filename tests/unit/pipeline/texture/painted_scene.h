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

/// Painted balls on the turntable under fixed lamps, photographed by own formulae: ray against sphere, OpenCV's
/// undistortion. No code is shared with the code under test.
class PaintedScene {
 public:
  std::vector<Ball> balls;
  /// Linear BGR, 0..1, at a point of ball `index`.
  std::function<Eigen::Vector3d(std::size_t index, const Eigen::Vector3d& point)> paint;
  /// Brightness of white with this normal (turntable frame).
  std::function<double(const Eigen::Vector3d& normal)> lamps = [](const Eigen::Vector3d&) { return 1.0; };

  /// Triangles of about `edge` mm, vertices on the balls, no normals.
  [[nodiscard]] Mesh mesh(double edge) const;
  /// The photo of `camera` with the table at each angle; 3 x 3 rays per pixel.
  [[nodiscard]] std::vector<Photo> photos(const Camera& camera, const std::vector<double>& angles_rad) const;
  [[nodiscard]] Photo photo(const Camera& camera, double angle_rad) const;

 private:
  [[nodiscard]] Photo expose(const Camera& camera, double angle_rad, const std::vector<cv::Point2d>& rays) const;
};

/// A camera of the default rig at a share of its resolution: `azimuth` from the rig's middle, with lens distortion.
Camera rig_camera(double azimuth_rad, double elevation_rad, double image_scale);

/// Soft stripes in all directions and colours, finest period 3 mm.
Eigen::Vector3d striped(const Eigen::Vector3d& point);

/// `count` table angles all around.
std::vector<double> turns(int count);

}  // namespace scanrig::testing
