#include "daemon/ctl/watch.h"

#include "core/clock.h"
#include "daemon/ctl/answers.h"
#include "daemon/ctl/job_lines.h"
#include "daemon/ctl/screen.h"
#include "daemon/ctl/verbs.h"
#include "daemon/runtime/signal_stop.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

constexpr auto kGlance = std::chrono::milliseconds(250);
constexpr auto kGlancePatience = std::chrono::seconds(3);  ///< who watches wants to see that a daemon hangs

tl::expected<json, RequestError> glance(const Connection& connection, const std::string& target) {
  return send_request(connection.socket, "GET", "/api/v1/" + target, "", kGlancePatience);
}

void add_health(const json& health, std::vector<std::string>& lines) {
  lines.push_back("");
  for (const auto& device : health.at("devices")) {
    const bool there = device.at("ok").get<bool>();
    lines.push_back(
        fmt::format("{:<10} {}", text(device, "name"), there ? "there" : text(device.at("problem"), "message")));
  }
  std::string machine = fmt::format("disk {} free", bytes_text(health.at("disk").at("free_bytes")));
  for (const auto& one : health.at("temperatures")) {
    machine += fmt::format(", {} {:.0f} C", text(one, "sensor"), one.at("celsius").get<double>());
  }
  lines.push_back(machine);
  lines.push_back(fmt::format("{} deadlines missed, {} exposures retried, {} faults",
                              health.at("deadlines_missed").get<int>(), health.at("retakes").get<int>(),
                              health.at("faults").get<int>()));
}

/// Null where there is none.
tl::expected<json, RequestError> job_to_show(const Connection& connection, const json& status) {
  auto id = text(status, "job");
  if (id.empty()) {
    const auto page = glance(connection, "jobs?limit=1");
    if (!page) return tl::unexpected(page.error());
    if (page->at("jobs").empty()) return json();
    id = text(page->at("jobs")[0], "id");
  }
  auto job = glance(connection, "jobs/" + segment(id));
  if (!job && job.error().exit == ExitCode::bad_input) return json();  // gone in between
  return job;
}

tl::expected<std::vector<std::string>, RequestError> look(const Connection& connection) {
  const auto status = glance(connection, "status");
  if (!status) return tl::unexpected(status.error());
  const auto health = glance(connection, "health");
  if (!health) return tl::unexpected(health.error());
  const auto job = job_to_show(connection, *status);
  if (!job) return tl::unexpected(job.error());
  if (!connection.json) return watch_lines(*status, *health, *job);
  auto both = *status;
  both.erase("revision");  // it changes when nothing else does
  return std::vector{json{{"status", both}, {"job", *job}}.dump(-1, ' ', false, json::error_handler_t::replace)};
}

/// A line a change, for programs.
void tell(const std::vector<std::string>& lines, std::string& told) {
  if (lines.at(0) == told) return;
  told = lines[0];
  fmt::print("{}\n", told);
  std::fflush(stdout);
}

}  // namespace

std::vector<std::string> watch_lines(const json& status, const json& health, const json& job) {
  std::vector<std::string> lines{fmt::format("{}  ({})", text(status, "machine"), text(status, "activity")),
                                 text(status, "sentence"), "because: " + text(status, "cause")};
  if (const auto action = text(status, "next_action"); !action.empty()) lines.push_back("next:    " + action);
  if (status.at("may_be_moving").get<bool>()) lines.push_back("THE TABLE MAY BE MOVING");
  if (const auto queued = status.value("queue", json::array()); !queued.empty()) {
    lines.push_back(fmt::format("queued:  {} jobs, next {}", queued.size(), queued[0].get<std::string>()));
  }
  if (job.is_object()) {
    lines.push_back("");
    for (auto& line : job_lines(job)) lines.push_back(std::move(line));
  }
  add_health(health, lines);
  return lines;
}

/// A daemon that goes away is waited for: it is what somebody who watches wants to see.
ExitCode watch(const Connection& connection) {
  const SignalStop stop;
  RealClock clock;
  std::optional<Screen> screen;
  std::string told;
  bool ever = false;
  for (; !stop.token().stop_requested(); clock.sleep_for(kGlance)) {
    const auto lines = look(connection);
    if (!lines && (!ever || connection.json)) return report_error(lines.error());
    ever = true;
    if (connection.json) {
      tell(*lines, told);
    } else {
      if (!screen) screen.emplace(stdout);
      screen->show(lines ? *lines : std::vector{lines.error().message, std::string("Trying again. Ctrl-C ends this.")});
    }
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
