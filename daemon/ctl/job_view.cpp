#include "daemon/ctl/job_view.h"

#include <fmt/format.h>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"
#include "daemon/station/states.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

/// Retakes of a view or a movement check.
std::string retakes(const json& taken) {
  const int count = taken.at("retakes");
  std::string text = count == 0 ? "" : fmt::format(", {} exposure{} retaken", count, count == 1 ? "" : "s");
  for (const auto& why : taken.at("retake_reasons")) text += "\n      retaken: " + why.at("message").get<std::string>();
  return text;
}

std::string view_line(const json& view, const json& job) {
  return fmt::format("  pose {}/{}  view {}/{}  {:8.3f} deg  stored{}", view.at("pose").get<int>() + 1,
                     job.at("poses").get<int>(), view.at("view").get<int>() + 1, job.at("views").get<int>(),
                     view.at("measured_deg").get<double>(), retakes(view));
}

std::string movement_line(const json& movement_check, const json& job) {
  return fmt::format("  pose {}/{}  view 1 again  {}, off by {:.2f} px{}", movement_check.at("pose").get<int>() + 1,
                     job.at("poses").get<int>(), movement_check.at("unmoved").get<bool>() ? "nothing moved" : "MOVED",
                     movement_check.at("shift_px").get<double>(), retakes(movement_check));
}

}  // namespace

std::optional<Error> why_not_started(const json& status, const std::string& job) {
  const auto not_started = status.value("not_started", json());
  if (!not_started.is_object() || text(not_started, "job") != job) return std::nullopt;
  const auto& why = not_started.at("why");
  const auto next = text(status, "next_action");
  return Error{
      parse_error_code(text(why, "code")).value_or(ErrorCode::internal),
      fmt::format("job {} did not start: {}{}{}", job, text(why, "message"), next.empty() ? "" : ". Next: ", next)};
}

void JobStory::wait(const json& status) {
  const auto cause = text(status, "cause"), next = text(status, "next_action");
  if (cause == waited_) return;
  waited_ = cause;
  bars_.line(fmt::format("Waiting for a job. {} {}{}{}", cause, text(status, "sentence"),
                         next.empty() ? "" : " Next: ", next));
}

bool JobStory::tell(const json& status, const json& job) {
  const auto& stored = job.at("stored");
  if (!introduced_) bars_.line(fmt::format("Job {}", job.at("id").get<std::string>()));
  introduced_ = true;
  for (; views_told_ < stored.size(); ++views_told_) bars_.line(view_line(stored[views_told_], job));
  const auto& movement_checks = job.at("movement_checks");
  for (; movement_checks_reported_ < movement_checks.size(); ++movement_checks_reported_)
    bars_.line(movement_line(movement_checks[movement_checks_reported_], job));
  const auto state = parse_job_state(job.at("state").get<std::string>());
  const std::string action = state == JobState::waiting_for_flip ? status.at("next_action").get<std::string>() : "-";
  if (action != asked_ && action != "-" && !action.empty()) bars_.line("  " + action);
  asked_ = action;
  for (const auto& stage : job.at("stages")) bars_.update(stage.at("name"), stage.at("fraction"));
  return state && is_final(*state);
}

ExitCode JobStory::end(const json& job) {
  const std::string state = job.at("state");
  const bool done = state == to_string(JobState::done);
  bars_.end(done);
  const bool passed = job.value("passed", json()) != false;
  if (done) {
    const std::chrono::duration<double> spent = clock_.now() - begun_;
    bars_.line(fmt::format("Done after {:.1f} s.\n  scan    {}\n  model   {}\n  report  {}", spent.count(),
                           job.at("folder").get<std::string>(), job.at("model").get<std::string>(),
                           job.at("report").get<std::string>()));
    if (passed) return ExitCode::ok;
  }
  const auto& error = job.at("error");
  const auto code = error.is_object() ? parse_error_code(error.at("code").get<std::string>()) : std::nullopt;
  return report_error({code.value_or(ErrorCode::internal),
                       fmt::format("job {} {}: {}", job.at("id").get<std::string>(), done ? "does not pass" : state,
                                   error.is_object() ? error.at("message").get<std::string>() : "no reason given")});
}

namespace {

using nlohmann::json;

/// `taken`: a view or a movement check.
void add_retakes(const json& taken, const std::string& name, std::vector<std::string>& lines) {
  for (const auto& why : taken.value("retake_reasons", json::array())) {
    lines.push_back(fmt::format("  pose {} {}: an exposure was retaken: {}", taken.at("pose").get<int>() + 1, name,
                                text(why, "message")));
  }
}

}  // namespace

std::vector<std::string> job_lines(const json& job) {
  const auto stored = job.at("stored").size();
  const auto all = static_cast<std::size_t>(
      std::max(1, job.value("all_views", job.at("poses").get<int>() * job.at("views").get<int>())));
  const auto part = text(job, "part");
  std::vector<std::string> lines{
      fmt::format("job {}{}: {}", text(job, "id"), part.empty() ? "" : " of " + part, text(job, "state")),
      "  " + text(job, "sentence")};
  if (const auto action = text(job, "next_action"); !action.empty()) lines.push_back("  next: " + action);
  lines.push_back(fmt::format(
      "{}  {} of {}", bar("views stored", static_cast<double>(stored) / static_cast<double>(all)), stored, all));
  for (const auto& view : job.at("stored")) {
    add_retakes(view, fmt::format("view {}", view.value("view", 0) + 1), lines);
  }
  for (const auto& movement_check : job.at("movement_checks")) add_retakes(movement_check, "view 1 again", lines);
  for (const auto& stage : job.at("stages")) {
    lines.push_back(bar(text(stage, "name"), stage.at("fraction")));
  }
  for (const auto& choice : job.value("choices", json::array())) {
    lines.push_back(fmt::format("  choice {}{}: {}{}", choice.at("number").get<int>(),
                                choice.at("picked").get<bool>() ? ", picked" : "", text(choice, "sentence"),
                                text(choice, "image").empty() ? "" : ", " + text(choice, "image")));
  }
  if (const auto model = text(job, "model"); !model.empty()) lines.push_back("  model " + model);
  return lines;
}

}  // namespace scanrig::ctl
