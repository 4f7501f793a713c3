#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// The parts of a request target: "/api/v1/jobs/a%20b?limit=5" has segments api, v1, jobs, "a b" and a query.
struct RequestTarget {
  std::vector<std::string> segments;                       ///< decoded, none empty, none "." or ".."
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, in order
};

/// Fails with `invalid_input`: no leading slash, an invalid escape, a NUL or control character, an empty or dot
/// segment (also behind an escaped slash), a key twice, over 2048 bytes.
Result<RequestTarget> parse_target(std::string_view target);

}  // namespace scanrig
