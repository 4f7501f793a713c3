#pragma once

#include <nlohmann/json_fwd.hpp>

#include "sim/scene/effects.h"
#include "sim/scene/rig_variation.h"

namespace scanrig::sim {

/// Parts of truth files, docs/reference/scan-folder.md and docs/reference/calibration-images.md.
nlohmann::ordered_json transform_json(const Transform& transform);
/// Size and pinhole.
nlohmann::ordered_json lens_json(const Eye& eye);
/// As in calibration.json: without the lens residual.
nlohmann::ordered_json camera_json(const Eye& eye);
/// Sizes of all effects under "effects", and the material; of profile 1 nothing.
nlohmann::ordered_json profile_json(const ChosenProfile& chosen);
/// Cameras with their lens residual, the table and its rim dots: a drawn rig as it is.
nlohmann::ordered_json rig_json(const DrawnRig& rig);

}  // namespace scanrig::sim
