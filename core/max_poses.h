#pragma once

#include <cstddef>

namespace scanrig {

/// Poses of one scan: how often the object is put down.
inline constexpr std::size_t kMaxPoses = 8;

}  // namespace scanrig
