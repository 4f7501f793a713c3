#include "daemon/jobs/slurm_client.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <sstream>
#include <string_view>

#include "daemon/jobs/child_process.h"

namespace scanrig {
namespace {

/// Slurm's sentences about a controller that cannot be reached now, or whose messages cannot be signed or read.
constexpr std::array<std::string_view, 8> kUnreachable{
    "Unable to contact slurm controller",
    "Socket timed out",
    "Connection refused",
    "Zero Bytes were transmitted",
    "authentication error",
    "ommunication",
    "temporarily unable",
    "Resource temporarily unavailable",
};
constexpr std::string_view kForgotten = "Invalid job id";

std::optional<std::string> find_command(const std::filesystem::path& folder, const std::string& name) {
  if (!folder.empty()) {
    const auto file = folder / name;
    return ::access(file.c_str(), X_OK) == 0 ? std::optional(file.string()) : std::nullopt;
  }
  const char* const path = std::getenv("PATH");
  std::istringstream places(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string place; std::getline(places, place, ':');) {
    const auto file = std::filesystem::path(place) / name;
    if (!place.empty() && ::access(file.c_str(), X_OK) == 0) return file.string();
  }
  return std::nullopt;
}

/// The value behind "key=" in a line of scontrol; its values here have no spaces.
std::string value_of(const std::string& line, const std::string& key) {
  const auto at = line.find(" " + key + "=");
  if (at == std::string::npos) return "";
  const auto begin = at + key.size() + 2;
  return line.substr(begin, line.find(' ', begin) - begin);
}

int number_in(std::string_view text) {
  int number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

SlurmJob::State state_of(std::string_view word) {
  using State = SlurmJob::State;
  constexpr std::array<std::string_view, 6> kPending{"PENDING",      "CONFIGURING",  "REQUEUED",
                                                     "REQUEUE_HOLD", "SPECIAL_EXIT", "RESV_DEL_HOLD"};
  constexpr std::array<std::string_view, 7> kRunning{"RUNNING",   "COMPLETING", "SUSPENDED", "STOPPED",
                                                     "SIGNALING", "STAGE_OUT",  "RESIZING"};
  constexpr std::array<std::string_view, 6> kEnded{"COMPLETED", "FAILED",        "CANCELLED",
                                                   "TIMEOUT",   "OUT_OF_MEMORY", "DEADLINE"};
  const auto is_in = [&](const auto& words) { return std::ranges::find(words, word) != words.end(); };
  if (is_in(kPending)) return State::pending;
  if (is_in(kRunning)) return State::running;
  return is_in(kEnded) ? State::ended : State::lost;
}

}  // namespace

Result<std::vector<std::string>> SlurmClient::run(const std::string& command, std::vector<std::string> words,
                                                  const std::stop_token& stop) const {
  const auto program = find_command(commands_, command);
  if (!program) {
    return fail(ErrorCode::not_found, "Slurm: there is no command {} in {}; install the package slurm-client", command,
                commands_.empty() ? "PATH" : commands_.string());
  }
  words.insert(words.begin(), *program);
  std::vector<std::string> lines;
  const auto end = run_child(
      {.words = std::move(words), .limit = limit_, .on_line = [&](std::string_view line) { lines.emplace_back(line); }},
      stop);
  if (!end) return pass_on(end, "Slurm");
  if (end->code == 0) return lines;
  const auto& why = end->last_words;
  const bool is_away = std::ranges::any_of(
      kUnreachable, [&](std::string_view sentence) { return why.find(sentence) != std::string::npos; });
  if (is_away) return fail(ErrorCode::timeout, "Slurm's controller cannot be reached: {}", why);
  return fail(ErrorCode::refused, "Slurm refuses, {}; check the partition and the options for the cluster", why);
}

Result<std::string> SlurmClient::submit(const std::vector<std::string>& options, const std::filesystem::path& script,
                                        const std::stop_token& stop) const {
  std::vector<std::string> words{"--parsable", "--no-requeue"};
  words.insert(words.end(), options.begin(), options.end());
  words.push_back(script.string());
  const auto lines = run("sbatch", std::move(words), stop);
  if (!lines) return pass_on(lines);
  // "12", or "12;CLUSTER"
  const auto id = lines->empty() ? std::string() : lines->back().substr(0, lines->back().find(';'));
  if (id.empty() || id.find_first_not_of("0123456789") != std::string::npos) {
    return fail(ErrorCode::refused, "Slurm: sbatch printed no id of a job but '{}'",
                lines->empty() ? "" : lines->back());
  }
  return id;
}

Result<SlurmJob> SlurmClient::look(const std::string& id, const std::stop_token& stop) const {
  const auto lines = run("scontrol", {"show", "job", id, "--oneliner"}, stop);
  if (!lines && lines.error().message.find(kForgotten) != std::string::npos)
    return SlurmJob{.state = SlurmJob::State::lost, .word = "forgotten", .nodes = "", .exit_code = 0};
  if (!lines) return pass_on(lines);
  const auto line = lines->empty() ? std::string() : lines->front();
  const auto word = value_of(line, "JobState"), nodes = value_of(line, "NodeList");
  return SlurmJob{.state = state_of(word),
                  .word = word,
                  .nodes = nodes == "(null)" ? "" : nodes,
                  .exit_code = number_in(value_of(line, "ExitCode"))};
}

Result<std::optional<std::string>> SlurmClient::find(const std::string& name, const std::stop_token& stop) const {
  const auto lines = run("squeue", {"--noheader", "--name=" + name, "--format=%i"}, stop);
  if (!lines) return pass_on(lines);
  return lines->empty() ? std::nullopt : std::optional(lines->front());
}

Result<std::map<int, SlurmJob::State>> SlurmClient::tasks(const std::string& name, const std::stop_token& stop) const {
  const auto lines = run("squeue", {"--noheader", "--array", "--name=" + name, "--format=%K %T"}, stop);
  if (!lines) return pass_on(lines);
  std::map<int, SlurmJob::State> states;
  for (const auto& line : *lines) {
    const auto space = std::min(line.find(' '), line.size());
    states[number_in(line)] = state_of(std::string_view(line).substr(std::min(space + 1, line.size())));
  }
  return states;
}

Result<int> SlurmClient::max_array(const std::stop_token& stop) const {
  const auto lines = run("scontrol", {"show", "config"}, stop);
  if (!lines) return pass_on(lines);
  for (const auto& line : *lines) {
    const auto equals = line.find("= ");
    if (line.starts_with("MaxArraySize") && equals != std::string::npos)
      return number_in(std::string_view(line).substr(equals + 2));
  }
  return 1001;  // Slurm's default
}

Result<void> SlurmClient::cancel(const std::string& name) const {
  const auto done = run("scancel", {"--name=" + name}, {});
  if (!done) return pass_on(done);
  return {};
}

}  // namespace scanrig
