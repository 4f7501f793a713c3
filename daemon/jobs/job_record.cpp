#include "daemon/jobs/job_record.h"

#include <nlohmann/json.hpp>

#include "daemon/jobs/job_files.h"

namespace scanrig {
namespace {

using nlohmann::json;

constexpr int kLayout = 6;  ///< increase with every change below

json to_json(const std::optional<Error>& error) {
  if (!error) return nullptr;
  return {to_string(error->code), error->message};
}

json to_json(const std::vector<Error>& errors) {
  json list = json::array();
  for (const auto& error : errors) list.push_back(to_json(std::optional(error)));
  return list;
}

std::optional<Error> error_from(const json& j) {
  if (j.is_null()) return std::nullopt;
  return Error{parse_error_code(j.at(0).get<std::string>()).value_or(ErrorCode::internal), j.at(1)};
}

std::vector<Error> errors_from(const json& list) {
  std::vector<Error> errors;
  for (const auto& error : list) errors.push_back(error_from(error).value());
  return errors;
}

json views_of(const JobInfo& job) {
  json views = json::array();
  for (const auto& v : job.stored) {
    views.push_back({v.pose, v.view, v.measured_deg, to_json(v.retake_reasons), v.commanded_deg, v.settling_ms});
  }
  return views;
}

json movement_checks_of(const JobInfo& job) {
  json movement_checks = json::array();
  for (const auto& c : job.movement_checks) {
    movement_checks.push_back({c.pose, c.shift_px, c.changed, c.unmoved, to_json(c.retake_reasons)});
  }
  return movement_checks;
}

void read(const json& j, JobInfo& job) {
  job.id = j.at("id");
  job.folder = j.at("folder");
  job.state = parse_job_state(j.at("state").get<std::string>()).value();
  job.complete = j.at("complete");
  job.quarantined = j.at("quarantined");
  if (!j.at("passed").is_null()) job.passed = j.at("passed").get<bool>();
  job.error = error_from(j.at("error"));
  job.model = j.at("model");
  job.report = j.at("report");
  job.config_sha256 = j.at("config_sha256").get<std::vector<std::string>>();
  for (const auto& v : j.at("stored")) {
    job.stored.push_back({v.at(0), v.at(1), v.at(2), errors_from(v.at(3)), v.at(4), v.at(5)});
  }
  for (const auto& c : j.at("movement_checks")) {
    job.movement_checks.push_back({c.at(0), c.at(1), c.at(2), c.at(3), errors_from(c.at(4))});
  }
}

}  // namespace

std::string to_record(const JobInfo& job) {
  const json j = {{"layout", kLayout},
                  {"id", job.id},
                  {"folder", job.folder},
                  {"state", to_string(job.state)},
                  {"complete", job.complete},
                  {"quarantined", job.quarantined},
                  {"passed", job.passed ? json(*job.passed) : json()},
                  {"error", to_json(job.error)},
                  {"model", job.model},
                  {"report", job.report},
                  {"config_sha256", job.config_sha256},
                  {"stored", views_of(job)},
                  {"movement_checks", movement_checks_of(job)}};
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

bool from_record(const std::string& text, JobInfo& job) {
  try {
    const auto j = json::parse(text);
    if (j.at("layout") != kLayout) return false;
    read(j, job);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace scanrig
