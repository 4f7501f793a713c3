#include <unistd.h>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/ctl/client.h"
#include "daemon/ctl/job_view.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

constexpr auto kPoll = std::chrono::milliseconds(100);
constexpr auto kStandstillTimeout = std::chrono::seconds(10);  ///< the service gives the drive less

/// `id` empty: the active job, now or as soon as there is one.
ExitCode follow(const Connection& connection, std::string id) {
  RealClock clock;
  std::FILE* told = connection.json ? stderr : stdout;
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  JobStory story(bars);
  for (;; clock.sleep_for(kPoll)) {
    const auto status = send_request(connection.socket, "GET", "/api/v1/status");
    if (!status) return report_error(status.error());
    if (id.empty()) id = text(*status, "job");
    if (id.empty()) {
      story.wait(*status);
      continue;
    }
    if (const auto why = why_not_started(*status, id)) return report_error(*why);
    const auto job = send_request(connection.socket, "GET", "/api/v1/jobs/" + id);
    if (!job && job.error().exit == exit_code(ErrorCode::not_found) && text(*status, "job") == id) continue;  // not yet
    if (!job) return report_error(job.error());
    if (!story.tell(*status, *job)) continue;
    if (connection.json) print(*job);
    return story.end(*job);
  }
}

}  // namespace

ExitCode status(const Connection& connection, const StatusVerb& verb) {
  if (verb.watch) return watch(connection);
  if (verb.follow) return follow(connection, "");
  const auto answer = send_request(connection.socket, "GET", "/api/v1/status");
  if (!answer) return report_error(answer.error());
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

ExitCode health(const Connection& connection) {
  const auto answer = send_request(connection.socket, "GET", "/api/v1/health");
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
    return ExitCode::ok;
  }
  fmt::print("{}\n", answer->at("ok").get<bool>() ? "nothing is wrong" : "problems:");
  for (const auto& problem : answer->at("problems")) fmt::print("  {}\n", text(problem, "message"));
  const auto& disk = answer->at("disk");
  fmt::print("disk: {} free of {}\n", bytes_text(disk.at("free_bytes")), bytes_text(disk.at("bytes")));
  for (const auto& one : answer->at("temperatures")) {
    fmt::print("{}: {:.1f} degrees Celsius\n", text(one, "sensor"), one.at("celsius").get<double>());
  }
  fmt::print("since {:.0f} s: {} deadlines missed, {} retakes, {} faults\n", answer->at("uptime_s").get<double>(),
             answer->at("deadlines_missed").get<int>(), answer->at("retakes").get<int>(),
             answer->at("faults").get<int>());
  return ExitCode::ok;
}

ExitCode start(const Connection& connection, const StartVerb& verb) {
  const auto answer = send_request(connection.socket, "POST", "/api/v1/start");
  if (!answer) return report_error(answer.error());
  const auto id = text(*answer, "job");
  if (verb.follow) return follow(connection, id);
  if (connection.json) {
    print(*answer);
  } else {
    fmt::print("{}\n", id);
  }
  return ExitCode::ok;
}

ExitCode stop(const Connection& connection, const StopVerb& verb) {
  const auto stopped = send_request(connection.socket, "POST", "/api/v1/stop");
  if (!stopped) return report_error(stopped.error());
  if (!connection.json) {
    fmt::print("{}\n", text(*stopped, "sent"));
    if (const auto job = text(*stopped, "job"); !job.empty()) fmt::print("Job {} is interrupted.\n", job);
  }
  RealClock clock;
  const auto deadline = Deadline::after(clock, kStandstillTimeout);
  auto standstill = text(*stopped, "standstill");
  while (verb.wait && standstill == "pending" && !deadline.expired(clock)) {
    clock.sleep_for(kPoll);
    const auto status = send_request(connection.socket, "GET", "/api/v1/status");
    if (!status) return report_error(ExitCode::standstill_unknown, "stop was sent, but " + status.error().message);
    standstill = text(*status, "standstill");
  }
  const bool confirmed = standstill == "confirmed" || standstill == "moving";  // it moves again: it had stopped
  if (connection.json) {
    auto reply = *stopped;
    reply["standstill"] = standstill;
    print(reply);
  } else if (confirmed) {
    fmt::print("The table has stopped.\n");
  }
  if (confirmed) return ExitCode::ok;
  return report_error(ExitCode::standstill_unknown,
                      standstill == "pending"
                          ? "standstill is not confirmed yet; run scanrig status"
                          : "the table may be moving: keep clear, check the drive's power and cable");
}

ExitCode press(const Connection& connection, const std::string& button) {
  const auto answer = send_request(connection.socket, "POST", "/api/v1/" + button);
  if (!answer) return report_error(answer.error());
  if (connection.json) print(*answer);
  return ExitCode::ok;
}

namespace {

void print_io(const nlohmann::json& io) {
  for (const char* side : {"inputs", "outputs"}) {
    fmt::print("{}\n", side);
    for (const auto& [name, value] : io.at(side).items()) fmt::print("  {:<14} {}\n", name, value.get<bool>() ? 1 : 0);
  }
}

std::string body_of(const MaintenanceVerb& verb) {
  if (verb.what != "jog") return "";
  const bool to = verb.to_deg.has_value();
  return nlohmann::json{{to ? "to_deg" : "by_deg", to ? *verb.to_deg : verb.by_deg.value_or(0.0)},
                        {"speed_deg_s", verb.speed_deg_s}}
      .dump();
}

}  // namespace

ExitCode maintenance(const Connection& connection, const MaintenanceVerb& verb) {
  const bool io = verb.what == "io";
  if (verb.what == "jog" && verb.to_deg.has_value() == verb.by_deg.has_value()) {
    return report_error(ExitCode::usage, "maintenance jog needs --to or --by");
  }
  const auto answer = io ? send_request(connection.socket, "GET", "/api/v1/io")
                         : send_request(connection.socket, "POST", "/api/v1/maintenance/" + verb.what, body_of(verb));
  if (!answer) return report_error(answer.error().exit, answer.error().message);
  if (connection.json) {
    fmt::print("{}\n", answer->dump(2));
  } else if (io) {
    print_io(*answer);
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
