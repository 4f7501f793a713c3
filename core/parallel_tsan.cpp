// Loops for a build with the thread sanitizer, which cannot follow how TBB hands work from thread to thread. Threads
// are started and joined here; no other synchronisation between the bodies could hide a race.

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include "core/parallel.h"

namespace scanrig {
namespace {

thread_local std::size_t threads_here = 0;  // 0: all of the machine's

}  // namespace

void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) {
  const std::size_t max_threads = threads_here > 0 ? threads_here : std::thread::hardware_concurrency();
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    with_threads(1, [&] {  // a loop inside a body finds all processors taken
      const auto take = [&] { return next.fetch_add(1, std::memory_order_relaxed); };
      for (std::size_t i = take(); i < count; i = take()) body(i);
    });
  };
  std::vector<std::jthread> others;
  for (std::size_t k = 1; k < std::min(max_threads, count); ++k) others.emplace_back(work);
  work();
}

void with_threads(int threads, const std::function<void()>& work) {
  const std::size_t before = std::exchange(threads_here, static_cast<std::size_t>(std::max(threads, 0)));
  work();
  threads_here = before;
}

}  // namespace scanrig
