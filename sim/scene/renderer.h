#pragma once

#include <opencv2/core/mat.hpp>

#include "sim/scene/bounce_light.h"
#include "sim/scene/dot_pattern.h"
#include "sim/scene/handling.h"
#include "sim/scene/lamp.h"
#include "sim/scene/object.h"
#include "sim/scene/optics.h"
#include "sim/scene/ray_caster.h"
#include "sim/scene/ray_map.h"
#include "sim/scene/room_light.h"
#include "sim/scene/screen_light.h"
#include "sim/scene/table_top.h"

namespace scanrig::sim {

/// The light on one sensor, before the lens's blur: 32-bit float RGB, 1.0 = full scale.
struct Radiance {
  cv::Mat pattern;
  cv::Mat plain;
};

/// What profile 2 adds in one view; a nullptr adds nothing.
struct ViewEffects {
  Effects effects{};
  Handling handling{};
  ScreenColour colour = ScreenColour::blue;  ///< of screen and table
  const BounceLight* bounce = nullptr;
  const ScreenLight* screen = nullptr;
  const RayMap* rays = nullptr;  ///< of the camera: as its lens, at less cost
};

/// One object on the table in one pose.
struct Placed {
  const Object& object;
  const RayCaster& rays;
  const RoomLight& light;
  Transform table_from_object;
  const RimDotErrors& rim_dots = kRimDotsAsDesigned;
};

/// Both exposures of one camera with the table at `angle` (radians). Each pixel is a square of four samples turned by a
/// random angle: prefiltered signals (dots, textures, shading) are then the same up to third order for every angle;
/// pixels on an edge take sixteen jittered samples. `sampling_seed` chooses the random angles. Same arguments, same
/// bits, for any number of threads.
Radiance render(const Placed& placed, const Eye& camera, const Eye& projector, const DotPattern& dots, double angle,
                std::uint64_t sampling_seed = 0, const ViewEffects& effects = {});

}  // namespace scanrig::sim
