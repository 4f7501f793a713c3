#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig::ctl {

/// Why a request was not answered with success.
struct RequestError {
  ExitCode exit = ExitCode::internal;
  std::string message;
};

/// For a whole request: connecting, sending it, the answer.
constexpr std::chrono::seconds kReplyTimeout{15};

/// One request to the daemon behind `socket` and its JSON answer. Fails with `unreachable` (no daemon, or it has not
/// answered within `limit`) or with the exit code of the API's error.
tl::expected<nlohmann::json, RequestError> send_request(const std::filesystem::path& socket, const std::string& method,
                                                        const std::string& target, const std::string& body = "",
                                                        Clock::Duration limit = kReplyTimeout);

/// The same for an answer that is no JSON: its bytes, such as a picture.
tl::expected<std::string, RequestError> fetch(const std::filesystem::path& socket, const std::string& target);

/// How much of how much has come.
using Arrived = std::function<void(std::uint64_t bytes, std::uint64_t of)>;

/// Writes what the daemon sends for GET `target` to `out`, which must not be there; after a failure it is not there.
/// It has `limit` to begin with the file, then kReplyTimeout for each piece. Fails as send_request(), with `bad_input`
/// (the file is there) and `disk`.
tl::expected<void, RequestError> download(const std::filesystem::path& socket, const std::string& target,
                                          const std::filesystem::path& out, const Arrived& arrived,
                                          Clock::Duration limit = kReplyTimeout);

/// `text` as one segment of a target: what is no letter, digit or one of ._- is escaped.
std::string segment(std::string_view text);

}  // namespace scanrig::ctl
