#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace scanrig::ctl {

/// What a person wants to know of one job: `job` as GET jobs/ID gives it.
std::vector<std::string> job_lines(const nlohmann::json& job);

}  // namespace scanrig::ctl
