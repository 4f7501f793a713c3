#pragma once

#include "pipeline/range/range_image.h"
#include "pipeline/range/rectification.h"

namespace scanrig {

/// The rectified frames of cameras that have moved since they were rectified: each moved with its camera, they are no
/// longer parallel.
struct MovedFrames {
  Transform left_from_turntable = Transform::Identity();
  Transform right_from_turntable = Transform::Identity();
};
MovedFrames carry_frames(const Rectification& rectification, const Calibration& was, const Calibration& is);

/// Depth of a matched view from the same disparities when the cameras are where `frames` says, and the table at
/// `angle_rad`. Directions of lines of sight stay, so nothing is matched again. Sigma is scaled; normals, background
/// and row offsets stay. Of the move itself nothing is left to first order; rows that do not correspond count as they
/// were matched. For motions of a pixel or less.
void retriangulate(View& view, const Rectification& rectification, const MovedFrames& frames, double angle_rad);

}  // namespace scanrig
