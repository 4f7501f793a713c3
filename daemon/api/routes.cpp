#include "daemon/api/routes.h"

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
          {"poses", job.poses},
          {"views", job.views},
          {"stored", job.stored.size()},
          {"model", job.model},
          {"report", job.report},
          {"error", to_json(job.error)}};
}

ordered_json to_detailed_json(const JobInfo& job) {
  auto json = to_json(job);
  json["stored"] = ordered_json::array();
  for (const auto& v : job.stored) {
    json["stored"].push_back(
        {{"pose", v.pose}, {"view", v.view}, {"measured_deg", v.measured_deg}, {"redone", v.redone}});
  }
  json["stages"] = ordered_json::array();
  for (const auto& stage : job.stages) json["stages"].push_back({{"name", stage.name}, {"fraction", stage.fraction}});
  return json;
}

ordered_json to_json(const Snapshot& snapshot) {
  return {{"revision", snapshot.revision},
          {"machine", to_string(snapshot.machine)},
          {"activity", to_string(snapshot.activity)},
          {"cause", snapshot.cause},
          {"sentence", snapshot.sentence},
          {"next_action", snapshot.next_action},
          {"job", snapshot.job.empty() ? ordered_json(nullptr) : ordered_json(snapshot.job)}};
}

ApiResponse respond(unsigned status, const ordered_json& json) {
  // Paths come from the file system and need not be UTF-8.
  return {status, json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n"};
}

ApiResponse respond(unsigned status, const Error& error) {
  return respond(status, ordered_json{{"error", to_json(std::optional(error))}});
}

ApiResponse unknown(const std::string& target) {
  return respond(404, Error{ErrorCode::not_found, "the API has no " + target});
}

ApiResponse get(const std::string& what, const Snapshot& snapshot, const std::string& target) {
  if (what == "status") return respond(200, to_json(snapshot));
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

std::optional<Button> button_of(const std::string& what) {
  for (const auto button : {Button::start, Button::stop, Button::reset}) {
    if (what == to_string(button)) return button;
  }
  return std::nullopt;
}

}  // namespace

void answer(const ApiRequest& request, ControlLoop& loop, std::function<void(ApiResponse)> send) {
  const std::string prefix = "/api/v1/";
  if (!request.target.starts_with(prefix)) return send(unknown(request.target));
  const std::string what = request.target.substr(prefix.size());
  const auto button = button_of(what);
  if (request.method != (button ? "POST" : "GET")) {
    return send(respond(405, Error{ErrorCode::unsupported, request.target + " does not take " + request.method}));
  }
  if (!button) return send(get(what, *loop.snapshot(), request.target));
  loop.press(*button, Origin::remote, [send = std::move(send)](const Result<std::string>& job) {
    send(job ? respond(200, ordered_json{{"job", job->empty() ? ordered_json(nullptr) : ordered_json(*job)}})
             : respond(409, job.error()));
  });
}

}  // namespace scanrig
