#pragma once

#include <string>

#include "daemon/station/transition.h"

namespace scanrig {

struct Words {
  std::string sentence;     ///< what is going on
  std::string next_action;  ///< what the operator should do; empty: nothing
};

Words describe(const StationState& state, const StationRules& rules);

}  // namespace scanrig
