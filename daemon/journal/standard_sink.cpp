#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#define SD_JOURNAL_SUPPRESS_LOCATION  // source lines are no use to the operator
#include <systemd/sd-journal.h>

#include "daemon/journal/journal.h"
#include "daemon/station/timestamp.h"

namespace scanrig {
namespace {

const char* name_of(Priority priority) {
  switch (priority) {
    case Priority::error: return "error";
    case Priority::warning: return "warning";
    case Priority::notice: return "notice";
    case Priority::info: return "info";
  }
  return "";
}

bool stderr_is_the_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  if (!stream || ::fstat(STDERR_FILENO, &file) != 0) return false;
  return fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

void send_to_journal(const JournalEntry& entry) {
  auto fields = journal_fields(entry);
  std::vector<iovec> parts;
  for (auto& field : fields) parts.push_back({field.data(), field.size()});
  ::sd_journal_sendv(parts.data(), static_cast<int>(parts.size()));
}

void print_line(const JournalEntry& entry) {
  fmt::print(stderr, "{}\n", text_line(entry, std::chrono::system_clock::now()));
}

}  // namespace

std::vector<std::string> journal_fields(const JournalEntry& entry) {
  std::vector<std::string> fields{"MESSAGE=" + entry.message,
                                  fmt::format("PRIORITY={}", static_cast<int>(entry.priority))};
  if (!entry.job.empty()) fields.push_back("JOB=" + entry.job);
  if (entry.pose) fields.push_back(fmt::format("POSE={}", *entry.pose));
  if (entry.view) fields.push_back(fmt::format("VIEW={}", *entry.view));
  if (!entry.device.empty()) fields.push_back("DEVICE=" + entry.device);
  return fields;
}

std::string text_line(const JournalEntry& entry, std::chrono::system_clock::time_point now) {
  std::string about;
  if (!entry.job.empty()) about += " job " + entry.job;
  if (entry.pose) about += fmt::format(" pose {}", *entry.pose);
  if (entry.view) about += fmt::format(" view {}", *entry.view);
  if (!entry.device.empty()) about += " " + entry.device;
  return fmt::format("{} {}{}: {}", iso_time(now), name_of(entry.priority), about, entry.message);
}

Journal::Sink standard_sink() { return stderr_is_the_journal() ? send_to_journal : print_line; }

}  // namespace scanrig
