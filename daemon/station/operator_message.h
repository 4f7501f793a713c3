#pragma once

#include <string>

#include "daemon/station/job_info.h"
#include "daemon/station/transition.h"

namespace scanrig {

/// Text for a person, on the panel, the page and the command line.
struct OperatorMessage {
  std::string sentence;     ///< what happens now
  std::string next_action;  ///< what the operator should do, if only to wait
};

/// The rig as a whole.
OperatorMessage describe(const StationState& state, const StationRules& rules);

/// One job: its state, the reason for it, and what to do about it.
OperatorMessage describe(const JobInfo& job);

/// Next action when a pose is complete.
std::string how_to_flip(const Recipe& recipe, bool guard_closed = true);

}  // namespace scanrig
