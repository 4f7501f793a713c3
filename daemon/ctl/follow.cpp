#include "daemon/ctl/follow.h"

#include <nlohmann/json.hpp>

#include "daemon/ctl/verbs.h"
#include "daemon/station/states.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

std::string view_line(const json& view, const json& job) {
  const int redone = view.at("redone");
  std::string line = fmt::format(
      "  pose {}/{}  view {}/{}  {:8.3f} deg  stored{}", view.at("pose").get<int>() + 1, job.at("poses").get<int>(),
      view.at("view").get<int>() + 1, job.at("views").get<int>(), view.at("measured_deg").get<double>(),
      redone == 0 ? "" : fmt::format(", {} exposure{} redone", redone, redone == 1 ? "" : "s"));
  for (const auto& why : view.at("spoilt")) line += "\n      redone: " + why.at("message").get<std::string>();
  return line;
}

}  // namespace

bool JobStory::tell(const json& status, const json& job) {
  const auto& stored = job.at("stored");
  if (!introduced_) bars_.line(fmt::format("Job {}", job.at("id").get<std::string>()));
  introduced_ = true;
  for (; views_told_ < stored.size(); ++views_told_) bars_.line(view_line(stored[views_told_], job));
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
  if (done) {
    const std::chrono::duration<double> spent = clock_.now() - begun_;
    bars_.line(fmt::format("Done after {:.1f} s.\n  scan    {}\n  model   {}\n  report  {}", spent.count(),
                           job.at("folder").get<std::string>(), job.at("model").get<std::string>(),
                           job.at("report").get<std::string>()));
    return ExitCode::ok;
  }
  const auto& error = job.at("error");
  const auto code = error.is_object() ? parse_error_code(error.at("code").get<std::string>()) : std::nullopt;
  return complain({code.value_or(ErrorCode::internal),
                   fmt::format("job {} {}: {}", job.at("id").get<std::string>(), state,
                               error.is_object() ? error.at("message").get<std::string>() : "no reason given")});
}

}  // namespace scanrig::ctl
