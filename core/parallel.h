#pragma once

#include <cstddef>
#include <functional>

namespace scanrig {

/// Runs `body(i)` for i in [0, count) on the pool of the current thread's arena. Bodies must not depend on order,
/// results not on the thread. Use rows or blocks, not single pixels: the call is indirect.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body);

/// Runs `work` with parallel_for limited to `threads` threads (0: all of the machine's).
void with_threads(int threads, const std::function<void()>& work);

}  // namespace scanrig
