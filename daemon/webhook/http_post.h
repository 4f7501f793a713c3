#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "core/result.h"

namespace scanrig {

struct HttpAddress {
  std::string host, port, path;
};

/// Sends `json` by POST. Fails with `timeout` (of the whole exchange, the look-up of the name included), `io` (cannot
/// connect, cut off), `protocol` (a reply other than 2xx). `stopped` comes at once, whatever it is waiting for.
Result<void> http_post(const HttpAddress& address, const std::string& json, std::chrono::milliseconds limit,
                       const std::stop_token& stop = {});

}  // namespace scanrig
