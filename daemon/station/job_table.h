#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "daemon/station/events.h"

namespace scanrig {

/// All jobs by id, oldest first. Entries are immutable: a changed job is a new entry, so that copies are cheap.
using JobTable = std::map<std::string, std::shared_ptr<const JobInfo>>;

/// A job that has come to its end.
struct JobEnd {
  std::string job;
  JobState state;
};

/// The table after `event`, and the job that ended with it. Jobs the table does not know are ignored, except in
/// JobUpdated.
std::optional<JobEnd> update(JobTable& table, const Event& event);

/// The table once `task` is handed out: to whoever looks the job has ended, however long its disk takes to note it.
std::optional<JobEnd> close(JobTable& table, const action::CloseJob& task);

}  // namespace scanrig
