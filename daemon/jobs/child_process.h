#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace scanrig {

struct ChildCommand {
  std::vector<std::string> words;                                           ///< the program's path first
  std::chrono::seconds limit = std::chrono::hours(1);                       ///< then it is killed
  std::optional<std::uintmax_t> memory_bytes{};                             ///< of private memory; larger requests fail
  std::function<void(std::string_view)> on_line = [](std::string_view) {};  ///< each line of its standard output
};

struct ChildEnd {
  int code = 0;            ///< exit code; where a signal ended it -1
  int signal = 0;          ///< 0: no signal ended it
  std::string last_words;  ///< the last line of its standard error
};

/// Runs a program at low priority, first in line for the kernel's OOM killer, to its end. It dies with this process
/// and is killed on `stop` or when the limit passes. It inherits only the two outputs. Fails with `io` (cannot be
/// started), `stopped`, `timeout`.
Result<ChildEnd> run_child(const ChildCommand& command, const std::stop_token& stop);

}  // namespace scanrig
