#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace scanrig {
namespace {

TEST(Parallel, EveryIndexIsVisitedOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7}) {
    std::vector<std::atomic<int>> visits(1000);
    with_threads(threads, [&] { parallel_for(visits.size(), [&](std::size_t i) { ++visits[i]; }); });
    for (const auto& count : visits) ASSERT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace scanrig
