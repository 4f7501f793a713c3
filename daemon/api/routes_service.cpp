#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/files.h"
#include "core/timestamp.h"
#include "core/version.h"
#include "daemon/api/json_replies.h"
#include "daemon/api/metrics.h"
#include "daemon/api/route.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

/// Present problems, of any kind.
ordered_json problems_of(const Snapshot& snapshot, const ServiceStatus& facts) {
  ordered_json problems = ordered_json::array();
  for (const auto& device : snapshot.devices) {
    if (device.problem) problems.push_back(to_json(*device.problem));
  }
  if (snapshot.calibration_problem) problems.push_back(to_json(*snapshot.calibration_problem));
  if (snapshot.may_be_moving) problems.push_back(to_json(Error{ErrorCode::timeout, snapshot.cause}));
  if (facts.tokens_problem) problems.push_back(to_json(*facts.tokens_problem));
  return problems;
}

std::vector<std::string> reminders_of(const Snapshot& snapshot) {
  if (snapshot.calibration_reminder.empty()) return {};
  return {snapshot.calibration_reminder};
}

}  // namespace

ordered_json health_json(const ApiStation& station) {
  const auto snapshot = station.loop.snapshot();
  const ServiceStatus facts = station.facts();
  auto problems = problems_of(*snapshot, facts);
  ordered_json temperatures = ordered_json::array();
  for (const auto& one : facts.temperatures) {
    temperatures.push_back({{"sensor", one.sensor}, {"celsius", one.celsius}});
  }
  const auto status = to_json(*snapshot);
  return {{"ok", problems.empty()},
          {"problems", std::move(problems)},
          {"reminders", reminders_of(*snapshot)},
          {"version", kVersion},
          {"uptime_s", facts.uptime_s},
          {"devices", status["devices"]},
          {"disk", {{"bytes", facts.disk_bytes}, {"free_bytes", facts.disk_free_bytes}}},
          {"temperatures", std::move(temperatures)},
          {"deadlines_missed", snapshot->counters.deadlines_missed},
          {"retakes", snapshot->counters.retakes},
          {"retries", snapshot->counters.retakes},  // old name
          {"faults", snapshot->counters.faults},
          {"connections", facts.connections},
          {"event_streams", facts.event_streams}};
}

namespace {

/// An object whose fields of these names are all texts.
bool has_texts(const ordered_json& object, std::initializer_list<const char*> names) {
  return object.is_object() && std::ranges::all_of(names, [&](const char* name) {
           return object.contains(name) && object[name].is_string();
         });
}

/// Array of objects of which only the texts of these names are kept; those without are left out.
ordered_json texts_of(const ordered_json& report, const char* list, std::initializer_list<const char*> names) {
  ordered_json kept = ordered_json::array();
  if (!report.contains(list) || !report[list].is_array()) return kept;
  for (const auto& object : report[list]) {
    if (!has_texts(object, names)) continue;
    ordered_json one;
    for (const char* name : names) one[name] = object[name];
    kept.push_back(std::move(one));
  }
  return kept;
}

/// The doctor works while the service is stopped, and leaves its report in a file.
void doctor(const ApiStation& station, const Values&, const Send& send) {
  const auto text = read_file(station.storage / kDoctorFile);
  const auto report = ordered_json::parse(text ? *text : std::string(), nullptr, false);
  if (!has_texts(report, {"time"})) {
    return send({.body = to_text({{"time", nullptr}, {"findings", ordered_json::array()}})});
  }
  send({.body = to_text(
            {{"time", report["time"]}, {"findings", texts_of(report, "findings", {"id", "problem", "remedy"})}})});
}

void metrics(const ApiStation& station, const Values&, const Send& send) {
  send({.body = metrics_text(*station.loop.snapshot(), station.facts()), .type = "text/plain; version=0.0.4"});
}

/// A camera that does not respond now may do so later.
void preview(const ApiStation& station, const Values& values, const Send& send) {
  auto jpeg = station.preview_jpeg(*values.text("side"), values.flag("middle"));
  if (!jpeg && values.flag("or_nothing")) return send({.status = 204, .type = "image/jpeg"});
  send(jpeg ? ApiResponse{.body = std::move(*jpeg), .type = "image/jpeg"} : error_response(503, jpeg.error()));
}

void log_lines(const ApiStation& station, const Values& values, const Send& send) {
  ordered_json lines = ordered_json::array();
  const auto after = static_cast<std::uint64_t>(values.integer("after").value_or(0));
  for (const auto& line : station.log ? station.log->after(after) : std::vector<RecentLog::Line>()) {
    lines.push_back({{"number", line.number},
                     {"time", iso_time(line.time)},
                     {"priority", to_string(line.entry.priority)},
                     {"job", line.entry.job},
                     {"device", line.entry.device},
                     {"message", line.entry.message}});
  }
  send({.body = to_text({{"lines", std::move(lines)}})});
}

void check_config(const ApiStation& station, const Values&, const Send& send) {
  const auto checked = station.check_config();
  if (!checked && checked.error().code == ErrorCode::refused) return send(error_response(checked.error()));
  ordered_json problems = ordered_json::array();
  std::istringstream lines(checked ? std::string() : checked.error().message);
  for (std::string line; std::getline(lines, line);) problems.push_back(line);
  send({.body = to_text({{"ok", checked.has_value()}, {"problems", std::move(problems)}})});
}

void reload(const ApiStation& station, const Values&, Send send) {
  station.reload([send = std::move(send)](const Result<std::string>& taken) {
    send(taken ? ApiResponse{.body = to_text(ordered_json::object())} : error_response(taken.error()));
  });
}

void document(const ApiStation&, const Values&, const Send& send) {
  static const std::string text = openapi_document(all_routes());
  send({.body = text});
}

}  // namespace

std::vector<Route> service_routes() {
  return {{.method = Method::get,
           .path = "/api/v1/health",
           .role = Role::viewer,
           .description = "Devices, disk, temperatures, deadlines missed, retakes.",
           .reply = {.description = "`ok` is false when something is wrong", .schema = "Health"},
           .handle = [](const ApiStation& station, const Values&,
                        const Send& send) { send({.body = to_text(health_json(station))}); }},
          {.method = Method::get,
           .path = "/api/v1/doctor",
           .role = Role::viewer,
           .description = "What `scanrig doctor` found when it last examined the rig.",
           .reply = {.description = "`time` is null where it never did", .schema = "Doctor"},
           .slow = true,
           .handle = doctor},
          {.method = Method::get,
           .path = "/api/v1/preview/{side}",
           .role = Role::viewer,
           .description = "The latest image of a camera. Requests a newer one while the rig is idle.",
           .in_path = {{.name = "side", .description = "of the rig", .required = true, .words = {"left", "right"}}},
           .in_query = {{.name = "or_nothing",
                         .type = RequestField::Type::flag,
                         .description = "204 instead of an error where there is no image: a page repeats it anyway"},
                        {.name = "middle",
                         .type = RequestField::Type::flag,
                         .description = "its middle 512 pixels in full resolution, to focus by"}},
           .reply = {.description = "an image", .type = "image/jpeg"},
           .slow = true,
           .handle = preview},
          {.method = Method::get,
           .path = "/api/v1/log",
           .role = Role::engineer,
           .description = "The newest 500 lines of the service's log since its start, oldest first.",
           .in_query = {{.name = "after",
                         .type = RequestField::Type::integer,
                         .description = "only lines with a higher number",
                         .min = 0,
                         .max = 1e15}},
           .reply = {.description = "lines with their numbers", .schema = "Log"},
           .handle = log_lines},
          {.method = Method::post,
           .path = "/api/v1/config/check",
           .role = Role::engineer,
           .description = "Reads the service's configuration file again and lists its problems. Changes nothing.",
           .reply = {.description = "every problem, with its line", .schema = "ConfigCheck"},
           .errors = {409},
           .slow = true,
           .handle = check_config},
          {.method = Method::post,
           .path = "/api/v1/reload",
           .role = Role::engineer,
           .description =
               "Restarts the service with its configuration file as it is now, if that is valid and the rig is idle; "
               "otherwise nothing changes. Afterwards the service waits for Reset. Connections are cut.",
           .reply = {.description = "the service restarts", .schema = "Nothing"},
           .errors = {404, 409, 500},
           .slow = true,
           .handle = reload},
          {.method = Method::get,
           .path = "/api/v1/openapi.json",
           .role = Role::viewer,
           .description = "This document.",
           .reply = {.description = "OpenAPI 3.0", .schema = "OpenApi"},
           .handle = document},
          {.method = Method::get,
           .path = "/metrics",
           .role = Role::viewer,
           .description = "For Prometheus.",
           .reply = {.description = "text format 0.0.4", .type = "text/plain; version=0.0.4"},
           .handle = metrics}};
}

}  // namespace scanrig
