#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::sim {

/// `scanrig-sim ctl DIR WORDS...`: says one thing to the simulated rig in DIR and prints its answer. Words: `get WHAT
/// [N]`, `set KEY=VALUE...`, `press|release|tap INPUT`, or one JSON object. Fails with `invalid_input`, `io`, and with
/// `refused` when the rig did not understand.
Result<std::string> control(const std::filesystem::path& folder, const std::vector<std::string>& words);

/// The request that the words mean, as one line of JSON. Fails with `invalid_input`.
Result<std::string> control_request(const std::vector<std::string>& words);

}  // namespace scanrig::sim
