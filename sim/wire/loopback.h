#pragma once

#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::sim::wire {

/// Puts this process into a network namespace of its own in which 127.0.0.1 and 127.0.0.2 exist and nothing else. Call
/// before the first thread. Fails with `io` where that is not allowed.
Result<void> enter_own_loopback();

/// Does so and becomes `command`. Returns only to fail, with `io`.
Result<void> run_in_own_loopback(const std::vector<std::string>& command);

}  // namespace scanrig::sim::wire
