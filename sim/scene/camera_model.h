#pragma once

#include <array>

#include "sim/scene/image_sensor.h"
#include "sim/scene/lens.h"

namespace scanrig::sim {

/// Lens and sensor of one camera.
/// Threads: const functions from any.
struct CameraModel {
  CameraModel(const ChosenProfile& profile, bool is_left, double image_scale)
      : lens(profile.effects, is_left, image_scale), sensor(profile.effects, is_left, profile.coding) {}

  Lens lens;
  ImageSensor sensor;
};

/// Left and right.
inline std::array<CameraModel, 2> both_cameras(const ChosenProfile& profile, double image_scale) {
  return {CameraModel(profile, true, image_scale), CameraModel(profile, false, image_scale)};
}

}  // namespace scanrig::sim
