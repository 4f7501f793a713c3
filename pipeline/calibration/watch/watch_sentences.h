#pragma once

#include <string>
#include <vector>

#include "pipeline/calibration/watch/moved_parts.h"
#include "pipeline/calibration/watch/watch.h"

namespace scanrig {

/// What the operator is told, the greatest departure first; nothing when all parts hold. `angle_rms_rad`: of the
/// table's angles.
std::vector<std::string> watch_sentences(const std::vector<WatchedPart>& parts, const TableChange& table,
                                         double angle_rms_rad);

std::string overlap_sentence(double axis_tilt_deg, double axis_shift_mm);

}  // namespace scanrig
