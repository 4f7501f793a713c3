#include "daemon/ctl/job_lines.h"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/ctl/answers.h"
#include "daemon/ctl/stage_bars.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

/// `taken`: a view or a movement check.
void add_retakes(const json& taken, const std::string& name, std::vector<std::string>& lines) {
  for (const auto& why : taken.value("retake_reasons", json::array())) {
    lines.push_back(fmt::format("  pose {} {}: an exposure was redone: {}", taken.at("pose").get<int>() + 1, name,
                                text(why, "message")));
  }
}

}  // namespace

std::vector<std::string> job_lines(const json& job) {
  const auto stored = job.at("stored").size();
  const auto all = static_cast<std::size_t>(std::max(1, job.at("poses").get<int>() * job.at("views").get<int>()));
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
  if (const auto model = text(job, "model"); !model.empty()) lines.push_back("  model " + model);
  return lines;
}

}  // namespace scanrig::ctl
