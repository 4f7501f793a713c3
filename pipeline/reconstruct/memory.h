#pragma once

#include <cstdint>

#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Bytes a stereo reconstruction of `views` views will need at its peak, for an object of half the table's size: what
/// the images ask for, and what the model asks for. Between 1.0 and 1.5 times what was measured on the objects of the
/// bench; twice as wide an object needs four times as much for its model.
std::uintmax_t estimated_memory(const Calibration& calibration, int views, double voxel_mm);

}  // namespace scanrig
