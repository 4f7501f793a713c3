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

/// Why a request did not succeed.
struct RequestError {
  ExitCode exit = ExitCode::internal;
  std::string message;
};

/// Limit for a whole request: connecting, sending it, the reply.
constexpr std::chrono::seconds kReplyTimeout{15};

/// Sends one request to the daemon behind `socket` and returns its JSON reply. Fails with `unreachable` (no daemon, or
/// no reply within `limit`) or with the exit code of the API's error.
tl::expected<nlohmann::json, RequestError> send_request(const std::filesystem::path& socket, const std::string& method,
                                                        const std::string& target, const std::string& body = "",
                                                        Clock::Duration limit = kReplyTimeout);

/// The same for a reply that is not JSON: its bytes, such as an image.
tl::expected<std::string, RequestError> fetch(const std::filesystem::path& socket, const std::string& target);

/// Bytes received so far, and in total.
using Arrived = std::function<void(std::uint64_t bytes, std::uint64_t of)>;

/// Writes the daemon's reply to GET `target` to `out`, which must not exist; after a failure it does not exist.
/// It has `limit` to start the file, then kReplyTimeout for each piece. Fails as send_request(), with `bad_input`
/// (the file exists) and `disk`.
tl::expected<void, RequestError> download(const std::filesystem::path& socket, const std::string& target,
                                          const std::filesystem::path& out, const Arrived& arrived,
                                          Clock::Duration limit = kReplyTimeout);

/// `text` as one segment of a target: all but letters, digits and ._- is escaped.
std::string segment(std::string_view text);

}  // namespace scanrig::ctl
