#pragma once

#include "pipeline/calibration/camera.h"
#include "pipeline/evaluate/evaluate.h"

namespace scanrig {

/// By how much the origin of the calibration's turntable frame lies above that of the truth's, mm along the axis. Where
/// on its axis a calibration has its origin is a convention (boards or the table's rim lie a few hundredths of a
/// millimetre beside the drawing), and shapes nothing. From points of the table top that both cameras see: projected
/// with the truth's cameras, triangulated with the calibration's. 0 where no such point is seen.
double frame_height(const Calibration& calibration, const Truth& truth);

/// The claim as in a frame whose origin lies `height` lower.
Claim raised(Claim claim, double height);

}  // namespace scanrig
