#pragma once

#include "core/result.h"

namespace scanrig::sim::wire {

/// Puts this process into a network namespace of its own in which 127.0.0.1 and 127.0.0.2 exist and nothing else. Call
/// before the first thread. Fails with `io` where that is not allowed.
Result<void> enter_own_loopback();

}  // namespace scanrig::sim::wire
