#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/result.h"
#include "daemon/journal/journal.h"
#include "daemon/station/job_info.h"

namespace scanrig {

/// The files of a job beside scan.json, docs/reference/scan-folder.md.

/// Paths of a job's model and report. The model of a calibration is its calibration.json.
std::filesystem::path model_folder(const std::filesystem::path& job_folder);
std::filesystem::path model_file(const std::filesystem::path& job_folder, RecipeKind kind = RecipeKind::scan);
std::filesystem::path report_file(const std::filesystem::path& job_folder);

/// live/NAME: what the scan shows so far, while it is made. Fails with `io`.
Result<void> write_live_file(const std::filesystem::path& job_folder, const std::string& name, std::string_view bytes);
void remove_live_files(const std::filesystem::path& job_folder);

struct FolderSize {
  std::uintmax_t bytes = 0;
  std::size_t files = 0;
};
/// Size of everything below `folder`. Unreadable files count as nothing.
FolderSize measure_folder(const std::filesystem::path& folder);

/// job.json: the order of the job.
struct JobFile {
  Recipe recipe{};
  std::string part{};
  std::int64_t place = 0;
  bool exported = false;
  bool accepted = false;  ///< a calibration that became the rig's
  int whole_poses = 0;    ///< of a scan that had all its views before it was given another pose; 0: it was not
};
/// Fails with `io`.
Result<void> write_job_file(const std::filesystem::path& job_folder, const JobFile& job);
/// Keys missing in a folder from elsewhere have the default. Fails with `invalid_input`, `unsupported`, `io`.
Result<JobFile> read_job_file(const std::filesystem::path& job_folder);
/// Notes whether the job's calibration became the rig's. Fails as both.
Result<void> set_accepted(const std::filesystem::path& job_folder, bool accepted);

/// Records durably that the job has no model, and why: failure.json. Fails with `io`.
Result<void> write_failure(const std::filesystem::path& job_folder, const Error& error);
/// Error of an earlier run; nothing where there is no such file.
std::optional<Error> read_failure(const std::filesystem::path& job_folder);
void remove_failure(const std::filesystem::path& job_folder);

/// attempt.json, written durably before a model is made of a whole scan, and removed at any end of that but the
/// daemon's death. Missing while views are being taken.
struct AttemptRecord {
  int ended_by_death = 0;
  bool running = false;  ///< in this process, now
};
AttemptRecord read_attempt_record(const std::filesystem::path& job_folder);
/// Records another attempt. Fails with `io`.
Result<void> begin_attempt(const std::filesystem::path& job_folder);
/// Durable. If the disk refuses it, the mark counts once too often.
void forget_attempts(const std::filesystem::path& job_folder);

/// Text of a calibration's report.json, and what it says; nothing where it cannot be read. Neither has `is_accepted`.
std::string calibration_report(const CalibrationOutcome& outcome);
std::optional<CalibrationOutcome> read_calibration_report(const std::filesystem::path& report);

/// calibration_check.json in the folder of all jobs: a check found that this calibration holds, now. Fails with `io`.
Result<void> note_check(const std::filesystem::path& root, const std::string& calibration_sha256);
/// ISO 8601; empty: this calibration was not checked, or the record cannot be read.
std::string last_check(const std::filesystem::path& root, const std::string& calibration_sha256);

/// What report.json says of the rig, of single images, of a symmetric part, of a pose that is known badly, and of
/// another rest than the suggested one, each sentence once; none where it cannot be read.
std::vector<std::string> read_remarks(const std::filesystem::path& report);

/// The ways in which pose 2 fits, from the job's folder; none where they cannot be read.
void take_choices(JobInfo& job);

/// Why the model of report.json is beyond the limits; nothing when it is within, or without limits. An unreadable
/// report never passes.
std::optional<Error> limit_violation(const std::filesystem::path& report, const Limits& limits);

/// log.jsonl of a job's folder: the job's entries of the log, one object per line, docs/reference/journal.md.
std::filesystem::path job_log_file(const std::filesystem::path& job_folder);

constexpr std::uintmax_t kMaxJobLogBytes = 4u << 20;

/// Appends an entry, without secrets. Not synced: after a power cut the last lines may be missing or torn. A log of
/// kMaxJobLogBytes gets a last line about its limit, then nothing more. Fails with `io`, `not_found` (no such folder).
Result<void> append_job_log(const std::filesystem::path& job_folder, const JournalEntry& entry,
                            std::chrono::system_clock::time_point when);

}  // namespace scanrig
