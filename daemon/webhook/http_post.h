#pragma once

#include <chrono>
#include <string>

#include "core/result.h"

namespace scanrig {

struct HttpAddress {
  std::string host, port, path;
};

/// Sends `json` by POST. Fails with `timeout` (of the whole exchange), `io` (cannot connect, cut off), `protocol` (an
/// answer other than 2xx).
Result<void> http_post(const HttpAddress& address, const std::string& json, std::chrono::milliseconds limit);

}  // namespace scanrig
