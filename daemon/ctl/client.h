#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/result.h"

namespace scanrig::ctl {

/// Why a request was not answered with success.
struct Refusal {
  ExitCode exit = ExitCode::internal;
  std::string message;
};

/// One request to the daemon behind `socket` and its JSON answer. Fails with `unreachable` (no daemon, or it does not
/// answer within 15 s) or with the exit code of the API's error.
tl::expected<nlohmann::json, Refusal> ask(const std::filesystem::path& socket, const std::string& method,
                                          const std::string& target);

/// The same for an answer that is no JSON: its bytes, such as a picture.
tl::expected<std::string, Refusal> fetch(const std::filesystem::path& socket, const std::string& target);

}  // namespace scanrig::ctl
