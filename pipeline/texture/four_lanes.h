#pragma once

#include <cstdint>

namespace scanrig {

/// Numbers side by side in one register of any processor: GCC's and Clang's vector types. Each lane is computed by
/// itself, so every processor gives the same bits.
using FourLanes = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));
using FourWords = std::uint32_t __attribute__((vector_size(16)));
using EightShorts = std::uint16_t __attribute__((vector_size(16)));
using SixteenBytes = std::uint8_t __attribute__((vector_size(16)));
using TwoLongs = std::uint64_t __attribute__((vector_size(16)));

}  // namespace scanrig
