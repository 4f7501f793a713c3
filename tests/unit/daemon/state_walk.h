#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/station/events.h"
#include "daemon/station/job_lifecycle.h"
#include "daemon/station/operator_message.h"

/// Walks through the transition function from its first state, and what each state on the way must fulfil.
namespace scanrig::state_walk {

struct Named {
  const char* name;
  Event event;
};

using Edges = std::map<std::pair<std::string, std::string>, std::set<std::string>>;

/// Findings of a walk; several walks may be added to one.
struct Walk {
  Edges machine, job;
  std::map<std::string, OperatorMessage> words;  ///< for the machine, where it was first reached
  std::set<std::string> wordless;                ///< states without a message, or without a next action
  std::set<std::string> untrue;                  ///< next actions that are refused
  std::set<std::string> unstoppable;             ///< states in which Stop is refused, not sent, or cancels a job
  std::size_t states = 0;
};

/// A job with two poses of one view, as the walk knows it under the identifier "job".
std::shared_ptr<const JobInfo> job(JobState state, const char* id = "job", RecipeKind kind = RecipeKind::scan);

/// Applies each of `events` in each state that they reach. `with_jobs`: the list of jobs makes a difference too.
/// `kind`: of every job.
void walk(const std::vector<Named>& events, bool with_jobs, Walk& walk, RecipeKind kind = RecipeKind::scan);

}  // namespace scanrig::state_walk
