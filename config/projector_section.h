#pragma once

#include "config/rig_config.h"
#include "config/section.h"

namespace scanrig::config {

/// [projector]; its light must last at least the cameras' `exposure`.
void read_projector(Section& s, std::chrono::microseconds exposure, ProjectorConfig& projector);

/// Rules between [projector] and the rest of a whole rig, whose [panel] has been read.
void check_projector(Section& s, const RigConfig& rig);

}  // namespace scanrig::config
