#pragma once

#include <functional>
#include <latch>
#include <memory>
#include <thread>
#include <utility>

#include "core/clock.h"

namespace scanrig {

/// Starts a thread that is an actor of `clock` for as long as it runs, and already when this returns.
inline std::thread start_actor(Clock& clock, std::function<void()> run) {
  auto entered = std::make_shared<std::latch>(1);
  std::thread thread([&clock, entered, run = std::move(run)] {
    const Clock::Actor actor(clock);
    entered->count_down();
    run();
  });
  entered->wait();
  return thread;
}

}  // namespace scanrig
