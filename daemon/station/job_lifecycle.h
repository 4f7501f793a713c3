#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "daemon/station/events.h"

namespace scanrig {

/// All jobs by id, oldest first. Entries are immutable: a changed job is a new entry, so that copies are cheap.
using JobTable = std::map<std::string, std::shared_ptr<const JobInfo>>;

/// A job that has ended.
struct JobEnd {
  std::string job;
  JobState state;
};

/// The table after `event`, and the job that ended with it. Ignores jobs missing from the table, except in
/// JobUpdated.
std::optional<JobEnd> update(JobTable& table, const Event& event);

/// Interrupted, and the missing views may still be taken: nothing has moved so far. A calibration takes the placement
/// in which its board moved again.
bool is_resumable(const JobInfo& job);

/// Content of the files in a job's folder beside its views.
struct FolderFacts {
  std::string manifest_state{};            ///< scan.json: queued, scanning, ..., scanned
  bool has_report = false;                 ///< the model is complete
  std::optional<Error> failure{};          ///< failure.json
  std::optional<Error> limit_violation{};  ///< of the report
  int deaths = 0;                          ///< attempt.json: reconstructions that ended with their process
  bool is_running = false;                 ///< attempt.json: one is under way in this process
};

/// Quarantine after this many reconstructions in a row that started and never ended: the service died in each.
constexpr int kAttemptsThatQuarantine = 2;
/// True after `deaths` reconstructions that ended with their process.
constexpr bool is_to_be_quarantined(int deaths) { return deaths >= kAttemptsThatQuarantine; }
/// The error of a quarantined job.
Error quarantine_error();

/// The state of a job as its folder records it: the inverse of what the steps of a job write there. `job` has its
/// recipe, views and movement checks already; its model and report paths are where they would be. A job being
/// scanned becomes interrupted, because its process has ended.
/// Checked against update(), over histories of jobs, by tests/component/daemon/job_history_test.cpp.
JobInfo with_state_of_folder(JobInfo job, const FolderFacts& facts);

/// The table once `task` is handed out: readers see the job as ended, however long its disk takes to record it.
std::optional<JobEnd> close(JobTable& table, const action::CloseJob& task);

}  // namespace scanrig
