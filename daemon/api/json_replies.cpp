#include "daemon/api/json_replies.h"

#include <nlohmann/json.hpp>

#include "core/timestamp.h"
#include "daemon/station/job_lifecycle.h"
#include "daemon/station/operator_message.h"

namespace scanrig {

using nlohmann::ordered_json;

namespace {

ordered_json devices_json(const std::vector<DeviceHealth>& devices) {
  ordered_json json = ordered_json::array();
  for (const auto& d : devices) {
    json.push_back({{"name", d.name}, {"ok", !d.problem}, {"problem", to_json(d.problem)}});
  }
  return json;
}

ordered_json not_started_json(const std::optional<NotStarted>& job) {
  return job ? ordered_json{{"job", job->job}, {"why", to_json(job->why)}} : ordered_json(nullptr);
}

ordered_json last_order_json(const std::optional<LastOrder>& order) {
  if (!order) return nullptr;
  return {{"what", order->what}, {"who", order->who}, {"when", iso_time(order->when)}};
}

}  // namespace

ordered_json to_json(const Error& error) { return {{"code", to_string(error.code)}, {"message", error.message}}; }

ordered_json to_json(const std::optional<Error>& error) { return error ? to_json(*error) : ordered_json(nullptr); }

ordered_json to_json(const JobInfo& job) {
  const auto words = describe(job);
  return {{"id", job.id},
          {"state", to_string(job.state)},
          {"sentence", words.sentence},
          {"next_action", words.next_action},
          {"recipe", job.recipe.name},
          {"part", job.part},
          {"folder", job.folder},
          {"poses", job.recipe.poses},
          {"views", job.recipe.views},
          {"stored", job.stored.size()},
          {"resumable", is_resumable(job)},
          {"quarantined", job.quarantined},
          {"exported", job.exported},
          {"passed", job.passed ? ordered_json(*job.passed) : ordered_json(nullptr)},
          {"model", job.model},
          {"report", job.report},
          {"remarks", job.remarks},
          {"config_sha256", job.config_sha256},
          {"error", to_json(job.error)},
          {"kind", to_string(job.recipe.kind)},
          {"all_views", job.recipe.all_views()}};
}

namespace {

ordered_json to_json(const std::vector<Error>& errors) {
  auto list = ordered_json::array();
  for (const auto& error : errors) list.push_back(scanrig::to_json(error));
  return list;
}

ordered_json action_json(const std::optional<Error>& refused) {
  return {{"ok", !refused}, {"why", refused ? ordered_json(refused->message) : ordered_json(nullptr)}};
}

ordered_json actions_json(const RemoteActions& actions) {
  auto start = action_json(actions.start_refused);
  start["does"] = actions.start_offer.starts_with("continue") ? "continue" : "begin";
  start["offer"] = actions.start_offer;
  return {{"start", std::move(start)}, {"stop", action_json({})}, {"reset", action_json(actions.reset_refused)}};
}

/// Number and reasons of the retakes.
void add_retakes(ordered_json& json, const std::vector<Error>& reasons) {
  json["retakes"] = json["redone"] = reasons.size();           // redone: old name
  json["retake_reasons"] = json["spoilt"] = to_json(reasons);  // spoilt: old name
}

ordered_json suggestions_json(const std::vector<SuggestedRest>& suggestions) {
  auto list = ordered_json::array();
  for (const auto& one : suggestions) {
    list.push_back({{"number", list.size() + 1},
                    {"sentence", one.sentence},
                    {"doubt", one.doubt},
                    {"gain", one.gain},
                    {"unseen_after", one.unseen_after},
                    {"overlap", one.overlap},
                    {"image", one.has_image}});
  }
  return list;
}

ordered_json choices_json(const JobInfo& job) {
  auto list = ordered_json::array();
  for (const auto& one : job.choices) {
    const auto number = list.size() + 1;
    list.push_back({{"number", number},
                    {"sentence", one.sentence},
                    {"image", one.image},
                    {"picked", static_cast<std::size_t>(job.picked) == number}});
  }
  return list;
}

}  // namespace

ordered_json to_detailed_json(const JobInfo& job) {
  auto json = to_json(job);
  json["stored"] = ordered_json::array();
  for (const auto& v : job.stored) {
    json["stored"].push_back({{"pose", v.pose},
                              {"view", v.view},
                              {"measured_deg", v.measured_deg},
                              {"error_deg", v.measured_deg - v.commanded_deg},
                              {"settling_ms", v.settling_ms}});
    if (v.problems) json["stored"].back()["problems"] = *v.problems;
    add_retakes(json["stored"].back(), v.retake_reasons);
  }
  json["movement_checks"] = ordered_json::array();
  for (const auto& c : job.movement_checks) {
    json["movement_checks"].push_back(
        {{"pose", c.pose}, {"shift_px", c.shift_px}, {"changed", c.changed}, {"unmoved", c.unmoved}});
    add_retakes(json["movement_checks"].back(), c.retake_reasons);
  }
  json["closures"] = json["movement_checks"];  // old name
  json["stages"] = ordered_json::array();
  for (const auto& stage : job.stages) json["stages"].push_back({{"name", stage.name}, {"fraction", stage.fraction}});
  json["live"] = job.live;
  json["suggestions"] = suggestions_json(job.suggestions);
  json["choices"] = choices_json(job);
  return json;
}

ordered_json to_json(const Snapshot& snapshot) {
  return {{"revision", snapshot.revision},
          {"machine", to_string(snapshot.machine)},
          {"activity", to_string(snapshot.activity)},
          {"may_be_moving", snapshot.may_be_moving},
          {"standstill", to_string(standstill(snapshot))},
          {"cause", snapshot.cause},
          {"sentence", snapshot.sentence},
          {"next_action", snapshot.next_action},
          {"tone", to_string(snapshot.headline.tone)},
          {"word", snapshot.headline.word},
          {"actions", actions_json(snapshot.actions)},
          {"devices", devices_json(snapshot.devices)},
          {"job", snapshot.job.empty() ? ordered_json(nullptr) : ordered_json(snapshot.job)},
          {"not_started", not_started_json(snapshot.not_started)},
          {"not_begun", not_started_json(snapshot.not_started)},  // old name
          {"queue", snapshot.queue},
          {"last_order", last_order_json(snapshot.last_order)}};
}

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

std::string to_text(const ordered_json& json) {
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string to_line(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace scanrig
