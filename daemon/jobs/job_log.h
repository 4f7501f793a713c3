#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>

#include "core/result.h"
#include "daemon/journal/journal.h"

namespace scanrig {

/// log.jsonl of a job's folder: the job's entries of the log, one object per line, docs/reference/journal.md.
std::filesystem::path job_log_file(const std::filesystem::path& job_folder);

constexpr std::uintmax_t kMaxJobLogBytes = 4u << 20;

/// Appends an entry, without secrets. Not synced: after a power cut the last lines may be missing or torn. A log of
/// kMaxJobLogBytes gets a last line about its limit, then nothing more. Fails with `io`, `not_found` (no such folder).
Result<void> append_job_log(const std::filesystem::path& job_folder, const JournalEntry& entry,
                            std::chrono::system_clock::time_point when);

}  // namespace scanrig
