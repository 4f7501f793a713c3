#pragma once

#include <optional>

#include "core/transform.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/observations.h"

namespace scanrig {

/// Where a board is, from one image alone: camera_from_board. `lens`: pinhole, near enough. None: fewer than twelve
/// corners, or no such place.
std::optional<Transform> board_pose(const Board& board, const BoardSight& sight, const Projection& lens);

}  // namespace scanrig
