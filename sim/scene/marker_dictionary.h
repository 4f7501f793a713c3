#pragma once

#include <array>
#include <vector>

namespace scanrig::sim {

/// The inner bits of one marker, row after row from the upper left one; true is white.
using MarkerBits = std::array<bool, 16>;

/// All markers of OpenCV's DICT_4X4_100, by id. The only file that depends on the version of OpenCV's markers.
std::vector<MarkerBits> dict_4x4_100();

}  // namespace scanrig::sim
