#include "daemon/jobs/node_run.h"

#include <algorithm>
#include <charconv>
#include <csignal>
#include <fstream>

#include "core/files.h"
#include "daemon/jobs/progress_lines.h"

namespace scanrig {
namespace {

/// A shell's exit code of a program that a signal ended is this plus the signal.
constexpr int kShellSignal = 128;

}  // namespace

std::filesystem::path run_model(const std::filesystem::path& run) { return run / "model"; }

std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

std::string run_function(const std::filesystem::path& program, const std::vector<std::string>& options) {
  std::string words;
  for (const auto& option : options) words += " " + shell_word(option);
  return fmt::format(R"(run() {{
  test -d "$2" || return {}
  {} reconstruct "$1" --lines --out "$2/model"{} > "$2/lines" 2> "$2/errors" < /dev/null
  code=$?
  echo $code > "$2/end.new" && mv "$2/end.new" "$2/end"
  return $code
}}
)",
                     kNoFolder, shell_word(program.string()), words);
}

std::optional<int> run_end(const std::filesystem::path& run) {
  const auto text = read_file(run / "end");
  int code = 0;
  if (!text || std::from_chars(text->data(), text->data() + text->size(), code).ec != std::errc()) return std::nullopt;
  return code;
}

bool was_ended_from_outside(int code) {
  return code == static_cast<int>(ExitCode::stopped) || code == kShellSignal + SIGTERM ||
         code == kShellSignal + SIGKILL;
}

Error run_error(const std::filesystem::path& run, int code, const std::optional<Error>& failure) {
  ChildEnd end{.code = code, .signal = code > kShellSignal ? code - kShellSignal : 0, .last_words = ""};
  std::ifstream errors(run / "errors");
  for (std::string line; std::getline(errors, line);) {
    if (!line.empty()) end.last_words = line;
  }
  return told_by(end, failure);
}

void RunLines::read(const std::function<void(std::string_view)>& take) {
  std::ifstream file(file_, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(read_));
  char buffer[4096];
  while (file.read(buffer, sizeof buffer), file.gcount() > 0) {
    read_ += static_cast<std::uintmax_t>(file.gcount());
    rest_.append(buffer, static_cast<std::size_t>(file.gcount()));
  }
  for (auto end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
    take(std::string_view(rest_).substr(0, end));
    rest_.erase(0, end + 1);
  }
}

}  // namespace scanrig
