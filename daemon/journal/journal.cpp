#include "daemon/journal/journal.h"

#define SD_JOURNAL_SUPPRESS_LOCATION  // source lines are no use to the operator
#include <systemd/sd-journal.h>

#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <fmt/format.h>
#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "core/timestamp.h"

namespace scanrig {
namespace {

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

std::string_view to_string(Priority priority) {
  switch (priority) {
    case Priority::error: return "error";
    case Priority::warning: return "warning";
    case Priority::notice: return "notice";
    case Priority::info: return "info";
  }
  return "";
}

void RecentLog::write(const JournalEntry& entry) {
  const std::scoped_lock lock(mutex_);
  lines_.push_back({++written_, std::chrono::system_clock::now(), entry});
  if (lines_.size() > kLines) lines_.pop_front();
}

std::vector<RecentLog::Line> RecentLog::after(std::uint64_t number) const {
  const std::scoped_lock lock(mutex_);
  if (number > written_) number = 0;
  const auto first = std::ranges::find_if(lines_, [&](const Line& line) { return line.number > number; });
  return {first, lines_.end()};
}

/// Outlives the Journal where a sink stalls. It waits on the real clock: the log takes no part in the rig's time.
struct Journal::Shared {
  Shared(Sink to, std::size_t most) : sink(std::move(to)), max_waiting(most) {}

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return ending || !waiting.empty() || dropped > 0; });
      if (waiting.empty() && dropped == 0) break;
      const auto lines = std::exchange(waiting, {});
      const auto lost = std::exchange(dropped, 0);
      lock.unlock();
      for (const auto& line : lines) sink(line);
      if (lost > 0) sink({Priority::warning, fmt::format("{} lines of the log were dropped: it was stalled.", lost)});
      lock.lock();
    }
    ended = true;
    changed.notify_all();
  }

  const Sink sink;
  const std::size_t max_waiting;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<JournalEntry> waiting;
  std::size_t dropped = 0;
  bool ending = false, ended = false;
};

Journal::Journal(Sink sink, std::size_t max_waiting) : shared_(std::make_shared<Shared>(std::move(sink), max_waiting)) {
  std::thread([shared = shared_] { shared->run(); }).detach();
}

Journal::~Journal() {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->changed.notify_all();
  shared_->changed.wait_for(lock, kLastWords, [this] { return shared_->ended; });
}

/// Text from files and devices may hold any bytes; a line of the log stays one line.
void Journal::write(JournalEntry entry) {
  for (auto* text : {&entry.message, &entry.job, &entry.device}) {
    std::ranges::replace_if(
        *text, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  }
  {
    const std::lock_guard guard(shared_->mutex);
    if (shared_->waiting.size() >= shared_->max_waiting) {
      ++shared_->dropped;
      return;
    }
    shared_->waiting.push_back(std::move(entry));
  }
  shared_->changed.notify_all();
}

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
  return fmt::format("{} {}{}: {}", iso_time(now), to_string(entry.priority), about, entry.message);
}

Journal::Sink standard_sink() { return stderr_is_the_journal() ? send_to_journal : print_line; }

}  // namespace scanrig
