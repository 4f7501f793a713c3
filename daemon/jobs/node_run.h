#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// One run of `scanrig reconstruct` on a node of a cluster. Its folder is seen by the node and by this machine and
/// has `model/`, `lines` (its standard output), `errors`, and at last `end` with its exit code. The folder's name is
/// new for each run: a run on a lost node that lives on changes nothing of the next one.

constexpr int kNoFolder = 66;  ///< exit code of the script when the node does not see the run's folder

std::filesystem::path run_model(const std::filesystem::path& run);

/// A shell function `run SCAN FOLDER` that does one run and returns its exit code. `options`: further words of
/// `scanrig reconstruct`.
std::string run_function(const std::filesystem::path& program, const std::vector<std::string>& options);

/// The text as one word for a shell.
std::string shell_word(const std::string& text);

/// Its exit code, once it has ended.
std::optional<int> run_end(const std::filesystem::path& run);

/// Whether a signal of the cluster ended the run: exit code `stopped`, or a shell's for SIGTERM and SIGKILL.
bool was_ended_from_outside(int code);

/// The error of a run that ended with `code`: its own `failure` line, else its last words.
Error run_error(const std::filesystem::path& run, int code, const std::optional<Error>& failure);

/// The lines of a run's output as they come. Threads: one user at a time.
class RunLines {
 public:
  explicit RunLines(const std::filesystem::path& run) : file_(run / "lines") {}
  /// `take` gets every whole line that is new.
  void read(const std::function<void(std::string_view)>& take);

 private:
  std::filesystem::path file_;
  std::uintmax_t read_ = 0;  ///< bytes
  std::string rest_;
};

}  // namespace scanrig
