#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/ctl/client.h"
#include "daemon/ctl/follow.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

constexpr auto kPoll = std::chrono::milliseconds(100);

ExitCode complain(const Refusal& refusal) { return ctl::complain(refusal.exit, refusal.message); }

void print(const json& answer) { fmt::print("{}\n", answer.dump(2, ' ', false, json::error_handler_t::replace)); }

std::string text(const json& object, const char* key) {
  return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : std::string();
}

/// `id` empty: the job that has the rig, now or as soon as there is one.
ExitCode follow(const Connection& connection, std::string id) {
  RealClock clock;
  StageBars bars(stdout, !connection.json && ::isatty(STDOUT_FILENO) == 1);
  JobStory story(bars);
  for (;; clock.sleep_for(kPoll)) {
    const auto status = ask(connection.socket, "GET", "/api/v1/status");
    if (!status) return complain(status.error());
    if (id.empty()) id = text(*status, "job");
    if (id.empty()) continue;
    const auto job = ask(connection.socket, "GET", "/api/v1/jobs/" + id);
    if (!job && job.error().exit == exit_code(ErrorCode::not_found) && text(*status, "job") == id) continue;  // not yet
    if (!job) return complain(job.error());
    if (connection.json) {
      const auto state = text(*job, "state");
      if (state != "done" && state != "failed" && state != "interrupted" && state != "cancelled") continue;
      print(*job);
      return state == "done" ? ExitCode::ok : story.end(*job);
    }
    if (story.tell(*status, *job)) return story.end(*job);
  }
}

void print_job(const json& job) {
  fmt::print("{:<22} {:<16} {:>2} views  {}\n", text(job, "id"), text(job, "state"), job.at("stored").get<int>(),
             job.at("error").is_object() ? text(job.at("error"), "message") : text(job, "model"));
}

}  // namespace

ExitCode status(const Connection& connection, bool follow_job) {
  if (follow_job) return follow(connection, "");
  const auto answer = ask(connection.socket, "GET", "/api/v1/status");
  if (!answer) return complain(answer.error());
  if (connection.json) {
    print(*answer);
    return ExitCode::ok;
  }
  fmt::print("{}: {}\n  because: {}\n", text(*answer, "machine"), text(*answer, "sentence"), text(*answer, "cause"));
  for (const auto& device : answer->at("devices")) {
    if (!device.at("ok").get<bool>()) fmt::print("  absent: {}\n", text(device.at("problem"), "message"));
  }
  if (const auto action = text(*answer, "next_action"); !action.empty()) fmt::print("  next: {}\n", action);
  if (const auto job = text(*answer, "job"); !job.empty()) fmt::print("  job: {}\n", job);
  return ExitCode::ok;
}

ExitCode jobs(const Connection& connection, const std::string& id) {
  const auto answer = ask(connection.socket, "GET", "/api/v1/jobs" + (id.empty() ? "" : "/" + id));
  if (!answer) return complain(answer.error());
  if (connection.json || !id.empty()) {
    print(*answer);
  } else {
    for (const auto& job : answer->at("jobs")) print_job(job);
  }
  return ExitCode::ok;
}

ExitCode start(const Connection& connection, bool follow_job) {
  const auto answer = ask(connection.socket, "POST", "/api/v1/start");
  if (!answer) return complain(answer.error());
  const auto id = text(*answer, "job");
  if (follow_job) return follow(connection, id);
  if (connection.json) {
    print(*answer);
  } else {
    fmt::print("{}\n", id);
  }
  return ExitCode::ok;
}

ExitCode press(const Connection& connection, const std::string& button) {
  const auto answer = ask(connection.socket, "POST", "/api/v1/" + button);
  if (!answer) return complain(answer.error());
  if (connection.json) print(*answer);
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
