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
  const auto lowest_niceness_of_helpers = [] {
    std::atomic<int> lowest = 100, met = 0;
    with_threads(kThreads, [&] {
      parallel_for(kThreads, [&](std::size_t) {
        ++met;
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
        while (met < kThreads && std::chrono::steady_clock::now() < end) std::this_thread::yield();
        for (int before = lowest; niceness() < before && !lowest.compare_exchange_weak(before, niceness());) {
        }
      });
    });
    return lowest.load();
  };
  const int ordinary = niceness();
  EXPECT_EQ(lowest_niceness_of_helpers(), ordinary);
  int background = 0;
  std::thread([&] {
    lower_priority();
    background = lowest_niceness_of_helpers();
  }).join();
  EXPECT_GE(background, std::min(ordinary + 1, 15));
  EXPECT_EQ(niceness(), ordinary);
}

}  // namespace
}  // namespace scanrig
