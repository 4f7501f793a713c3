#pragma once

#include <string>

#include "daemon/station/transition.h"

namespace scanrig {

struct Words {
  std::string sentence;     ///< what is going on
  std::string next_action;  ///< what the operator should do, if only to wait
};

Words describe(const StationState& state, const StationRules& rules);

/// What is to be done when a pose is complete.
std::string how_to_flip(const Recipe& recipe, bool guard_closed = true);

}  // namespace scanrig
