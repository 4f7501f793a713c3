#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "core/clock.h"
#include "daemon/station/events.h"
#include "drivers/turntable/turntable.h"

namespace scanrig {

/// The owner of the turntable: carries out the rig's requests one at a time, while the rig waits. Sends a stop
/// at once, whatever the rig is doing with the cameras meanwhile.
/// Threads: as for Turntable; the functions may be called from another thread than the turntable's own.
class TurntableThread final : public Turntable {
 public:
  TurntableThread(Turntable& turntable, Clock& clock);
  ~TurntableThread() override;
  TurntableThread(const TurntableThread&) = delete;
  TurntableThread& operator=(const TurntableThread&) = delete;

  Result<void> home(Deadline deadline) override;
  Result<Move> rotate_to(Degrees target, Deadline deadline) override;
  Result<void> stop(Deadline deadline) override;
  Result<void> reset_alarm(Deadline deadline) override;
  Result<TurntableStatus> status(Deadline deadline) override;
  Result<void> limit_speed(std::optional<DegreesPerSecond> limit) override;
  /// Ends what runs, and commands the drive to stop even when nothing does.
  void request_stop() noexcept override;
  /// A request_stop() from any thread, with evidence: the turntable's own thread calls `done` with what stop() returned
  /// by `limit`. It does not call `done` where the turntable itself hangs.
  void stop_directly(Clock::Duration limit, std::function<void(const Result<void>&)> done);
  void drop_stop_request() noexcept override { turntable_.drop_stop_request(); }

 private:
  template <class Answer>
  Answer ask(const std::function<Answer()>& what);
  void run();

  Turntable& turntable_;
  Clock& clock_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> task_;  // guarded by mutex_, as all below; empty: none, or done
  bool stop_wanted_ = false;
  struct DirectStop {
    Clock::Duration limit;
    std::function<void(const Result<void>&)> done;
  };
  std::optional<DirectStop> direct_stop_;  // for the requested stop
  bool end_ = false;
  std::thread thread_;
};

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
