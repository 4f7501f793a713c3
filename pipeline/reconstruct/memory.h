#pragma once

#include <cstddef>
#include <cstdint>

#include "core/result.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Bytes without which a stereo reconstruction of `views` views cannot be made, for an object of half the table's size:
/// one view that is matched, what is kept of all views, and the model. What is more is used as there is room.
std::uintmax_t min_memory(const Calibration& calibration, int views, double voxel_mm);

/// Fails with `out_of_range` where that is more than `memory_bytes`.
Result<void> check_memory(const Calibration& calibration, int views, double voxel_mm, std::uintmax_t memory_bytes);

/// Views that may be matched at once within `memory_bytes`, at most `wanted` and at least one.
std::size_t views_at_once(const Calibration& calibration, int views, std::uintmax_t memory_bytes, std::size_t wanted);

/// Of `memory_bytes` what this process does not hold now; 0 if it holds more.
std::uintmax_t memory_left(std::uintmax_t memory_bytes);

}  // namespace scanrig
