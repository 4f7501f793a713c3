#pragma once

#include <functional>
#include <mutex>
#include <thread>

#include "core/clock.h"
#include "daemon/station/events.h"

namespace scanrig {

/// Stops the table past a turntable that hangs, on a separate thread: one attempt at a time.
/// Threads: begin() from any, one at a time.
class OutsideStop {
 public:
  /// `stop` returns once standstill is confirmed; it may wait, but not for ever. `report` is called with Stopped or
  /// StopFailed.
  OutsideStop(Clock& clock, std::function<Result<void>()> stop, std::function<void(Event)> report)
      : clock_(clock), stop_(std::move(stop)), report_(std::move(report)) {}
  ~OutsideStop();
  OutsideStop(const OutsideStop&) = delete;
  OutsideStop& operator=(const OutsideStop&) = delete;

  /// Does not wait. An attempt already under way makes the report.
  void begin();

 private:
  void run();

  Clock& clock_;
  const std::function<Result<void>()> stop_;
  const std::function<void(Event)> report_;
  std::mutex mutex_;
  bool is_under_way_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace scanrig
