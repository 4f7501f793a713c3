#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sim/wire/gige_registers.h"

namespace scanrig::sim::wire {

/// Bytes of a frame in the camera's pixel format, made of what its `sensor` sees (8 bit, the whole sensor) by what the
/// registers say: binning, decimation, region, exposure over `nominal_us` (0: no effect), gain, black level, white
/// balance, look-up table, gamma, test pattern, chunks.
std::vector<std::uint8_t> develop_gige(const cv::Mat& sensor, const GigeRegisters& registers, double nominal_us,
                                       std::uint64_t stamp_ns);

/// Lets the automatics that are on change their values after a frame with this mean grey value.
void adjust_gige(GigeRegisters& registers, double mean);

}  // namespace scanrig::sim::wire
