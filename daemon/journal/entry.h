#pragma once

#include <optional>
#include <string>

namespace scanrig {

/// As syslog(3) numbers them.
enum class Priority { error = 3, warning = 4, notice = 5, info = 6 };

/// One line of the log; the fields are those of docs/reference/journal.md. Poses and views count from 0, as in
/// scan.json.
struct JournalEntry {
  Priority priority = Priority::info;
  std::string message{};
  std::string job{};  ///< empty: of none
  std::optional<int> pose{}, view{};
  std::string device{};  ///< empty: of none
};

}  // namespace scanrig
