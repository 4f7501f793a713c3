#include "core/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "core/priority.h"

namespace scanrig {
namespace {

TEST(Parallel, EveryIndexIsVisitedOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7}) {
    std::vector<std::atomic<int>> visits(1000);
    with_threads(threads, [&] { parallel_for(visits.size(), [&](std::size_t i) { ++visits[i]; }); });
    for (const auto& count : visits) ASSERT_EQ(count, 1);
  }
}

TEST(Parallel, ThreadsThatHelpALowPriorityThreadTakeItsPriority) {
  constexpr int kThreads = 4;
  const auto most_urgent_helper = [] {
    std::atomic<int> least = 100, met = 0;
    with_threads(kThreads, [&] {
      parallel_for(kThreads, [&](std::size_t) {
        ++met;
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
        while (met < kThreads && std::chrono::steady_clock::now() < end) std::this_thread::yield();
        for (int before = least; niceness() < before && !least.compare_exchange_weak(before, niceness());) {
        }
      });
    });
    return least.load();
  };
  const int ordinary = niceness();
  EXPECT_EQ(most_urgent_helper(), ordinary);
  int background = 0;
  std::thread([&] {
    lower_priority();
    background = most_urgent_helper();
  }).join();
  EXPECT_GE(background, std::min(ordinary + 1, 15));
  EXPECT_EQ(niceness(), ordinary);
}

}  // namespace
}  // namespace scanrig
