#pragma once

#include <cstdint>

#include "sim/scene/optics.h"

namespace scanrig::sim {

/// A smooth residual of `rms_px` over the image of `eye` (its residual is not used), drawn by the seed. To first order
/// it holds nothing that the eye's focal lengths, centre, distortion or rotation could take up.
LensResidual draw_lens_residual(const Eye& eye, double rms_px, std::uint64_t seed);

}  // namespace scanrig::sim
