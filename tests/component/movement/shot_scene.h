#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "sim/scene/object.h"
#include "sim/scene/optics.h"
#include "sim/scene/ray_caster.h"

namespace scanrig::sim {

/// Changes of the rig since view 0 was taken.
struct Disturbance {
  std::string name{};
  Transform object = Transform::Identity();  ///< slipped: in the table's frame
  double table_deg = 0.0;                    ///< the axis differs from its reported angle
  Transform camera = Transform::Identity();  ///< knocked: in the camera's own frame
};

/// A sensor that is worse than the simulated one.
struct Sensor {
  double blur_px = 0.0;     ///< sigma, beside the lens's
  double noise_grey = 0.0;  ///< sigma, beside shot and read noise
  double light = 1.0;       ///< as a share of the light before
};

/// The plain images of view 0 for movement checks: the simulated scene, rendered, under the default rig.
class ShotScene {
 public:
  ShotScene(Object object, double image_scale);

  /// The light on a camera's sensor: its mosaic, 32-bit float. Takes a second or two in full size.
  [[nodiscard]] cv::Mat look(const Disturbance& since, bool left = true) const;
  /// The image that the daemon compares: 8 bit BGR. `noise` names the exposure.
  [[nodiscard]] static cv::Mat shoot(const cv::Mat& on_sensor, std::uint64_t noise, const Sensor& sensor = {});

 private:
  Object object_;
  double image_scale_;
  Transform placement_;
  RigGeometry rig_;
  RayCaster rays_;
};

/// A pebble, smooth and of one even grey: only its shading and its outline show its position.
Object pebble();

}  // namespace scanrig::sim
