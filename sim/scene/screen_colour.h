#pragma once

#include <Eigen/Core>

#include "sim/scene/effects.h"
#include "sim/scene/surface_colour.h"

namespace scanrig::sim {

/// An albedo of the blue rig (backdrop, table, rim dots: RGB, linear) on a rig whose screen has another colour: green
/// is as green as the blue one is blue, none is as bright and grey.
inline Eigen::Vector3f on_screen(const double* blue, ScreenColour colour) {
  const Eigen::Vector3f own = rgb(blue);
  if (colour == ScreenColour::green) return {own.x(), own.z(), own.y()};
  if (colour == ScreenColour::none) return Eigen::Vector3f::Constant(own.mean());
  return own;
}

}  // namespace scanrig::sim
