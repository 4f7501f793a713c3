#pragma once

#include <cstdint>

#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Bytes that a stereo reconstruction of `views` views needs at its peak, for an object of half the table's size: the
/// images' share and the model's share. Between 1.0 and 1.5 times the measured values of the bench objects. An object
/// twice as wide needs four times as much for its model.
std::uintmax_t estimated_memory(const Calibration& calibration, int views, double voxel_mm);

}  // namespace scanrig
