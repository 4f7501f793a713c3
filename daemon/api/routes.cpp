#include "daemon/api/routes.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>

namespace scanrig {
namespace {

using nlohmann::ordered_json;

ordered_json to_json(const std::optional<Error>& error) {
  if (!error) return nullptr;
  return {{"code", to_string(error->code)}, {"message", error->message}};
}

ordered_json to_json(const JobInfo& job) {
  return {{"id", job.id},
          {"state", to_string(job.state)},
          {"folder", job.folder},
          {"poses", job.recipe.poses},
          {"views", job.recipe.views},
          {"stored", job.stored.size()},
          {"model", job.model},
          {"report", job.report},
          {"error", to_json(job.error)}};
}

ordered_json to_detailed_json(const JobInfo& job) {
  auto json = to_json(job);
  json["stored"] = ordered_json::array();
  for (const auto& v : job.stored) {
    json["stored"].push_back({{"pose", v.pose},
                              {"view", v.view},
                              {"measured_deg", v.measured_deg},
                              {"error_deg", v.measured_deg - v.commanded_deg},
                              {"settling_ms", v.settling_ms},
                              {"redone", v.redone}});
  }
  json["stages"] = ordered_json::array();
  for (const auto& stage : job.stages) json["stages"].push_back({{"name", stage.name}, {"fraction", stage.fraction}});
  return json;
}

ordered_json to_json(const std::vector<DeviceHealth>& devices) {
  ordered_json json = ordered_json::array();
  for (const auto& d : devices) {
    json.push_back({{"name", d.name}, {"ok", !d.problem}, {"problem", to_json(d.problem)}});
  }
  return json;
}

ordered_json to_json(const Snapshot& snapshot) {
  return {{"revision", snapshot.revision},
          {"machine", to_string(snapshot.machine)},
          {"activity", to_string(snapshot.activity)},
          {"may_be_moving", snapshot.may_be_moving},
          {"cause", snapshot.cause},
          {"sentence", snapshot.sentence},
          {"next_action", snapshot.next_action},
          {"devices", to_json(snapshot.devices)},
          {"job", snapshot.job.empty() ? ordered_json(nullptr) : ordered_json(snapshot.job)}};
}

/// What the panel's inputs and outputs are now.
ordered_json io_table(const Snapshot& snapshot) {
  const auto& in = snapshot.inputs;
  const auto& out = snapshot.outputs;
  return {{"inputs",
           {{"start", in.start},
            {"stop", in.stop},
            {"reset", in.reset},
            {"estop_ok", in.estop_ok},
            {"guard_closed", in.guard_closed},
            {"part_present", in.part_present},
            {"flipped", in.flipped}}},
          {"outputs",
           {{"lamp_red", out.red},
            {"lamp_amber", out.amber},
            {"lamp_green", out.green},
            {"start_lamp", out.start_lamp},
            {"flip_request", out.flip_request},
            {"busy", out.busy},
            {"pass", out.pass},
            {"fail", out.fail}}}};
}

ApiResponse respond(unsigned status, const ordered_json& json) {
  // Paths come from the file system and need not be UTF-8.
  return {.status = status, .body = json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n"};
}

ApiResponse respond(unsigned status, const Error& error) {
  return respond(status, ordered_json{{"error", to_json(std::optional(error))}});
}

ApiResponse unknown(const std::string& target) {
  return respond(404, Error{ErrorCode::not_found, "the API has no " + target});
}

ApiResponse get(const std::string& what, const Snapshot& snapshot, const std::string& target) {
  if (what == "status") return respond(200, to_json(snapshot));
  if (what == "io") return respond(200, io_table(snapshot));
  if (what == "jobs") {
    ordered_json jobs = ordered_json::array();
    for (const auto& [id, job] : snapshot.jobs) jobs.push_back(to_json(*job));
    return respond(200, {{"jobs", std::move(jobs)}});
  }
  if (what.starts_with("jobs/")) {
    const auto job = snapshot.jobs.find(what.substr(5));
    if (job != snapshot.jobs.end()) return respond(200, to_detailed_json(*job->second));
    return respond(404, Error{ErrorCode::not_found, "there is no job " + what.substr(5)});
  }
  return unknown(target);
}

/// A camera that does not answer now may do so later.
ApiResponse picture(const std::string& side, Preview& preview) {
  if (side != "left" && side != "right") {
    return respond(404, Error{ErrorCode::not_found, "there is a left and a right camera, no " + side});
  }
  auto jpeg = preview.jpeg(side == "left" ? Side::left : Side::right);
  if (jpeg) return {200, std::move(*jpeg), "image/jpeg"};
  return respond(503, jpeg.error());
}

std::optional<Button> button_of(const std::string& what) {
  for (const auto button : {Button::start, Button::stop, Button::reset}) {
    if (what == to_string(button)) return button;
  }
  return std::nullopt;
}

struct NamedRequest {
  std::string_view name;
  event::MaintenanceAsked::What what;
};
constexpr NamedRequest kMaintenance[] = {
    {"on", event::MaintenanceAsked::What::on},       {"off", event::MaintenanceAsked::What::off},
    {"home", event::MaintenanceAsked::What::home},   {"jog", event::MaintenanceAsked::What::jog},
    {"pulse", event::MaintenanceAsked::What::pulse}, {"lamp_test", event::MaintenanceAsked::What::lamp_test}};

/// The number behind `key=` in "a=1&b=2"; nothing when it is not there or is none.
std::optional<double> number_in(std::string_view query, std::string_view key) {
  for (std::size_t at = 0; at < query.size();) {
    const auto part = query.substr(at, query.find('&', at) - at);
    at += part.size() + 1;
    if (!part.starts_with(key) || part.size() <= key.size() || part[key.size()] != '=') continue;
    double value = 0.0;
    const auto read = std::from_chars(part.data() + key.size() + 1, part.data() + part.size(), value);
    if (read.ec == std::errc() && read.ptr == part.data() + part.size()) return value;
  }
  return std::nullopt;
}

/// "jog?by_deg=-5&speed_deg_s=2", "jog?to_deg=90", "on", ...
Result<event::MaintenanceAsked> maintenance_of(const std::string& text) {
  const auto mark = text.find('?');
  const std::string_view query =
      mark == std::string::npos ? std::string_view() : std::string_view(text).substr(mark + 1);
  const auto found = std::ranges::find(kMaintenance, text.substr(0, mark), &NamedRequest::name);
  if (found == std::end(kMaintenance)) return fail(ErrorCode::not_found, "maintenance has no {}", text);
  event::MaintenanceAsked asked{.what = found->what, .speed = kMaxJogSpeed};
  if (asked.what != event::MaintenanceAsked::What::jog) return asked;
  const auto to = number_in(query, "to_deg"), by = number_in(query, "by_deg");
  if (to.has_value() == by.has_value()) {
    return fail(ErrorCode::invalid_input, "a jog takes to_deg or by_deg, and speed_deg_s: jog?by_deg=5&speed_deg_s=2");
  }
  asked.relative = by.has_value();
  asked.angle = {to ? *to : *by};
  if (query.find("speed_deg_s") != std::string_view::npos) {
    asked.speed = {number_in(query, "speed_deg_s").value_or(0.0)};
  }
  return asked;
}

}  // namespace

void answer(const ApiRequest& request, ControlLoop& loop, Preview& preview, std::function<void(ApiResponse)> send) {
  const std::string prefix = "/api/v1/";
  if (!request.target.starts_with(prefix)) return send(unknown(request.target));
  const std::string what = request.target.substr(prefix.size());
  const auto button = button_of(what);
  const bool maintenance = what.starts_with("maintenance/");
  if (request.method != (button || maintenance ? "POST" : "GET")) {
    return send(respond(405, Error{ErrorCode::unsupported, request.target + " does not take " + request.method}));
  }
  if (maintenance) {
    const auto asked = maintenance_of(what.substr(12));
    if (!asked) return send(respond(asked.error().code == ErrorCode::not_found ? 404 : 400, asked.error()));
    return loop.ask(*asked, [send = std::move(send)](const Result<std::string>& done) {
      send(done ? respond(200, ordered_json::object()) : respond(409, done.error()));
    });
  }
  if (what.starts_with("preview/")) return send(picture(what.substr(8), preview));
  if (!button) return send(get(what, *loop.snapshot(), request.target));
  loop.press(*button, Origin::remote, [send = std::move(send)](const Result<std::string>& job) {
    send(job ? respond(200, ordered_json{{"job", job->empty() ? ordered_json(nullptr) : ordered_json(*job)}})
             : respond(409, job.error()));
  });
}

}  // namespace scanrig
