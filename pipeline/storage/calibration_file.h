#pragma once

#include <filesystem>

#include "core/result.h"
#include "core/strict_json.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Reads calibration.json. Fails with `not_found`, `io`, `invalid_input` (a number that is not finite, a rotation that
/// is none, a value no rig can have; naming file and key), `unsupported` (version).
Result<Calibration> read_calibration(const std::filesystem::path& file);

/// The "left" or "right" object of calibration.json and truth.json; faults are kept in its file.
Camera read_camera(JsonObject object);

/// The keys width, height, fx, fy, cx, cy of a camera or a projector.
Projection read_pinhole(JsonObject& object);

}  // namespace scanrig
