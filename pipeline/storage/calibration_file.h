#pragma once

#include <filesystem>

#include "core/result.h"
#include "core/strict_json.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Reads calibration.json. Fails with `not_found`, `io`, `invalid_input` (a number that is not finite, not a rotation
/// matrix, a value no rig can have; naming file and key), `unsupported` (version).
Result<Calibration> read_calibration(const std::filesystem::path& file);

/// The same from the text of calibration.json; `file` names it in messages.
Result<Calibration> parse_calibration(std::string_view text, const std::filesystem::path& file);

/// The "left" or "right" object of calibration.json and truth.json; faults are kept in its file.
Camera read_camera(JsonObject object);

/// The keys width, height, fx, fy, cx, cy of a camera or a projector.
Projection read_pinhole(JsonObject& object);

}  // namespace scanrig
