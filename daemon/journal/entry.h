#pragma once

#include <optional>
#include <string>

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

}  // namespace scanrig
