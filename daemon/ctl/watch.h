#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace scanrig::ctl {

/// The lines of `scanrig status --watch`. `status`, `health`: as the API gives them; `job`: the one that has the rig
/// or was the last to have it, null: none.
std::vector<std::string> watch_lines(const nlohmann::json& status, const nlohmann::json& health,
                                     const nlohmann::json& job);

}  // namespace scanrig::ctl
