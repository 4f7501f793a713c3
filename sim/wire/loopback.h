#pragma once

#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::sim::wire {

/// Moves this process into a network namespace of its own with only 127.0.0.1 and 127.0.0.2. Call before the first
/// thread. Fails with `io` where that is not allowed.
Result<void> enter_own_loopback();

/// Does the same, then becomes `command`. Returns only on failure, with `io`.
Result<void> run_in_own_loopback(const std::vector<std::string>& command);

}  // namespace scanrig::sim::wire
