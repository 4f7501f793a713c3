#include "core/virtual_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <latch>
#include <optional>
#include <thread>
#include <vector>

namespace scanrig {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Clock::TimePoint kNever = Clock::TimePoint::max();

/// A variable that threads change and wait for through a Clock.
template <class T>
struct Shared {
  explicit Shared(Clock& c) : clock(c) {}
  void set(T v) {
    {
      const std::lock_guard guard(mutex);
      value = v;
    }
    clock.notify_all(changed);
  }
  bool wait_for_value(T v, Clock::TimePoint until) {
    std::unique_lock lock(mutex);
    return clock.wait_until(lock, changed, until, [&] { return value == v; });
  }
  Clock& clock;
  std::mutex mutex;
  std::condition_variable changed;
  T value{};
};

TEST(VirtualClock, AnHourPassesAtOnceWhenNoOtherActorRuns) {
  VirtualClock clock;
  const auto start = clock.now();
  clock.sleep_for(hours(1));
  EXPECT_EQ(clock.now() - start, hours(1));
}

TEST(VirtualClock, AMomentThatHasPassedDoesNotWait) {
  VirtualClock clock;
  clock.sleep_for(seconds(5));
  const auto now = clock.now();
  clock.sleep_until(now - seconds(1));
  EXPECT_EQ(clock.now(), now);
}

TEST(VirtualClock, StandsStillWhileAnActorRuns) {
  VirtualClock clock;
  std::latch running(1);
  std::latch go_on(1);
  std::thread worker([&] {
    const Clock::Actor actor(clock);
    running.count_down();
    go_on.wait();  // works; does not wait in the clock
  });
  running.wait();
  std::atomic<bool> woke = false;
  Shared<bool> checked(clock);
  std::thread sleeper([&] {
    std::unique_lock lock(checked.mutex);
    clock.wait_until(lock, checked.changed, clock.now() + milliseconds(1), [&] { return checked.value; });
    woke = true;
  });
  // A notification makes the sleeper look again; had time moved meanwhile, it would be gone.
  for (int i = 0; i < 1000; ++i) clock.notify_all(checked.changed);
  EXPECT_EQ(clock.now(), Clock::TimePoint{});
  EXPECT_FALSE(woke);
  go_on.count_down();
  worker.join();
  sleeper.join();
  EXPECT_EQ(clock.now(), Clock::TimePoint{} + milliseconds(1));
}

TEST(VirtualClock, StandsStillWhileAHoldExists) {
  VirtualClock clock;
  auto busy = std::make_unique<Clock::Busy>(clock);
  std::thread sleeper([&] { clock.sleep_for(seconds(1)); });
  std::this_thread::yield();
  EXPECT_EQ(clock.now(), Clock::TimePoint{});
  busy.reset();
  sleeper.join();
  EXPECT_EQ(clock.now(), Clock::TimePoint{} + seconds(1));
}

TEST(VirtualClock, ActorsWakeInTheOrderOfTheirMoments) {
  VirtualClock clock;
  std::mutex mutex;
  std::vector<int> order;
  std::vector<std::thread> threads;
  {
    const Clock::Busy until_all_run(clock);
    std::latch entered(5);
    for (int i = 0; i < 5; ++i) {
      threads.emplace_back([&, i] {
        const Clock::Actor actor(clock);
        entered.count_down();
        for (int round = 0; round < 3; ++round) {
          clock.sleep_until(Clock::TimePoint{} + milliseconds(100 * round + 10 * (5 - i)));
          const std::lock_guard guard(mutex);
          order.push_back(round * 5 + (4 - i));
        }
      });
    }
    entered.wait();
  }
  for (auto& thread : threads) thread.join();
  ASSERT_EQ(order.size(), 15u);
  EXPECT_TRUE(std::ranges::is_sorted(order));
}

TEST(VirtualClock, ANotifiedWaiterIsNotOvertakenByItsDeadline) {
  // The hold ends right after the notification, when the waiter may not have run yet: a clock that counted it as
  // waiting would jump to its deadline.
  for (int round = 0; round < 2000; ++round) {
    const bool as_actor = round % 2 == 0;
    VirtualClock clock;
    Shared<int> message(clock);
    bool in_time = false;
    std::thread asker;
    {
      const Clock::Busy until_answered(clock);
      std::latch entered(1);
      asker = std::thread([&] {
        std::optional<Clock::Actor> actor;
        if (as_actor) actor.emplace(clock);
        entered.count_down();
        in_time = message.wait_for_value(42, clock.now() + milliseconds(10));
      });
      entered.wait();
      message.set(42);
    }
    asker.join();
    ASSERT_TRUE(in_time);
    ASSERT_EQ(clock.now(), Clock::TimePoint{});
  }
}

TEST(VirtualClock, TimeWaitsForANotifiedOutsiderToCheckAgain) {
  for (int round = 0; round < 500; ++round) {
    VirtualClock clock;
    auto busy = std::make_unique<Clock::Busy>(clock);
    std::thread sleeper([&] { clock.sleep_for(milliseconds(1)); });
    Shared<bool> changed_value(clock);
    std::latch looked(1);
    int looks = 0;
    Clock::TimePoint second_look{};
    std::thread outsider([&] {
      std::unique_lock lock(changed_value.mutex);
      clock.wait_until(lock, changed_value.changed, kNever, [&] {
        if (++looks == 1) looked.count_down();
        if (looks == 2) second_look = clock.now();
        return changed_value.value;
      });
    });
    looked.wait();
    changed_value.set(true);  // needs the lock: the outsider waits by now
    busy.reset();
    outsider.join();
    sleeper.join();
    ASSERT_EQ(second_look, Clock::TimePoint{});
  }
}

TEST(VirtualClock, AMessageBetweenActorsArrivesBeforeAnyTimePasses) {
  VirtualClock clock;
  Shared<int> question(clock);
  Shared<int> message(clock);
  constexpr int kRounds = 5000;
  std::thread server;
  int late = 0;
  {
    std::latch entered(1);
    const Clock::Busy start(clock);
    server = std::thread([&] {
      const Clock::Actor actor(clock);
      entered.count_down();
      for (int i = 1; i <= kRounds; ++i) {
        if (!question.wait_for_value(i, kNever)) ++late;
        message.set(i);
      }
    });
    entered.wait();
  }
  {
    const Clock::Actor actor(clock);
    for (int i = 1; i <= kRounds; ++i) {
      question.set(i);
      if (!message.wait_for_value(i, clock.now() + milliseconds(1))) ++late;
    }
  }
  server.join();
  EXPECT_EQ(late, 0);
  EXPECT_EQ(clock.now(), Clock::TimePoint{}) << "time moved although an actor always had work";
}

TEST(VirtualClock, NoWakeUpIsLostWhenOutsidersNotify) {
  VirtualClock clock;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<int> queue;
  constexpr int kMessages = 20000;
  long long sum = 0;
  std::thread consumer([&] {
    const Clock::Actor actor(clock);
    for (int i = 0; i < kMessages; ++i) {
      std::unique_lock lock(mutex);
      ASSERT_TRUE(clock.wait_until(lock, changed, kNever, [&] { return !queue.empty(); }));
      sum += queue.front();
      queue.pop_front();
    }
  });
  std::vector<std::thread> producers;
  for (int p = 0; p < 4; ++p) {
    producers.emplace_back([&] {
      for (int i = 0; i < kMessages / 4; ++i) {
        {
          const std::lock_guard guard(mutex);
          queue.push_back(1);
        }
        clock.notify_all(changed);
      }
    });
  }
  for (auto& thread : producers) thread.join();
  consumer.join();
  EXPECT_EQ(sum, kMessages);
}

TEST(VirtualClock, EndlessWaitsOfAllActorsMoveNothing) {
  VirtualClock clock;
  Shared<bool> stop(clock);
  std::thread waiter([&] {
    const Clock::Actor actor(clock);
    EXPECT_TRUE(stop.wait_for_value(true, kNever));
  });
  stop.set(true);
  waiter.join();
  EXPECT_EQ(clock.now(), Clock::TimePoint{});
}

TEST(VirtualClock, AnActorThatLeavesNoLongerHoldsTimeBack) {
  VirtualClock clock;
  std::latch entered(1);
  std::latch leave(1);
  std::thread brief([&] {
    const Clock::Actor actor(clock);
    entered.count_down();
    leave.wait();
  });
  entered.wait();
  std::thread sleeper([&] { clock.sleep_for(seconds(3)); });
  leave.count_down();
  sleeper.join();
  brief.join();
  EXPECT_EQ(clock.now(), Clock::TimePoint{} + seconds(3));
}

}  // namespace
}  // namespace scanrig
