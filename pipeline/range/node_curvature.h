#pragma once

#include <array>
#include <vector>

#include "pipeline/range/match_side.h"

namespace scanrig {

/// Second order of the disparity around each node, c3 to c5 of DisparityPatch: least squares through the disparities
/// of the nodes around it on its surface. Over their baseline of four strides disparities tell curvature more surely
/// than a window of its own size does, so windows start from it (WindowOptions::curvature). 0 where fewer than 12
/// nodes surround one.
/// Threads: spread over the current arena, same bits for any number.
std::vector<std::array<float, 3>> node_curvature(const Nodes& nodes, const StereoOptions& options);

}  // namespace scanrig
