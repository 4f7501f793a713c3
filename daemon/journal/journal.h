#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scanrig {

/// Numbers as in syslog(3).
enum class Priority { error = 3, warning = 4, notice = 5, info = 6 };

/// One line of the log; the fields are those of docs/reference/journal.md. Poses and views count from 0, as in
/// scan.json.
struct JournalEntry {
  Priority priority = Priority::info;
  std::string message{};
  std::string job{};  ///< empty: no job
  std::optional<int> pose{}, view{};
  std::string device{};  ///< empty: no device
};

/// Takes the log's lines from threads that must not wait: its own thread writes them. Lines that do not fit while the
/// sink is stalled are dropped and counted. The count is logged when the sink takes lines again.
class Journal {
 public:
  /// Called from the journal's thread only; may take its time.
  using Sink = std::function<void(const JournalEntry&)>;

  explicit Journal(Sink sink, std::size_t max_waiting = 1024);
  /// Writes the waiting lines, for at most `kLastWords`; a sink that still stalls then is abandoned.
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Takes an entry from any thread. Does not wait.
  void write(JournalEntry entry);

  static constexpr auto kLastWords = std::chrono::seconds(1);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

/// The newest lines of the log, for people who look at the page.
/// Threads: every function may be called from any.
class RecentLog {
 public:
  struct Line {
    std::uint64_t number = 0;  ///< from 1, in the order written
    std::chrono::system_clock::time_point time;
    JournalEntry entry;
  };

  void write(const JournalEntry& entry);
  /// Those after that number, oldest first; all of them where no line has that number yet, as after a restart.
  [[nodiscard]] std::vector<Line> after(std::uint64_t number) const;

  static constexpr std::size_t kLines = 500;

 private:
  mutable std::mutex mutex_;
  std::deque<Line> lines_;
  std::uint64_t written_ = 0;
};

std::string_view to_string(Priority priority);  ///< "error"

/// Under systemd, where stderr is the journal's own stream [systemd.exec(5), JOURNAL_STREAM]: entries with their
/// fields. Otherwise lines of text on stderr.
Journal::Sink standard_sink();

/// "NAME=value", as the journal takes them; fields that do not apply are left out.
std::vector<std::string> journal_fields(const JournalEntry& entry);

/// "2026-11-21T13:00:00Z notice job 20261121-130000-1 pose 0 view 3: ...", without an end of line.
std::string text_line(const JournalEntry& entry, std::chrono::system_clock::time_point now);

}  // namespace scanrig
