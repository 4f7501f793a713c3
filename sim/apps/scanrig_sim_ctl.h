#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::sim {

/// `scanrig-sim ctl DIR WORDS...`: sends one request to the simulated rig in DIR and prints its reply. Words: `get WHAT
/// [N]`, `set KEY=VALUE...`, `press|release|tap INPUT`, or one JSON object. Fails with `invalid_input`, `io`, and with
/// `refused` when the rig rejects the request.
Result<std::string> control(const std::filesystem::path& folder, const std::vector<std::string>& words);

/// The request for these words, as one line of JSON. Fails with `invalid_input`.
Result<std::string> control_request(const std::vector<std::string>& words);

}  // namespace scanrig::sim
