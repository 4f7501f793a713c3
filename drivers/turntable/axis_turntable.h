#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/turntable/axis_drive.h"
#include "drivers/turntable/axis_scale.h"
#include "drivers/turntable/move_planner.h"
#include "drivers/turntable/turntable.h"

namespace scanrig {

struct AxisTurntableOptions {
  AxisScale scale;                   ///< checked against the drive when homing
  std::string home_mode = "switch";  ///< how the drive homes, or "here": the present position is home
  DegreesPerSecond speed{45};
  DegreesPerSecond2 acceleration{90};
  Degrees backlash{0.5};
  Degrees tolerance{0.02};  ///< between target and measured angle, at the table
  std::chrono::milliseconds settle{200};
  std::optional<AngleRange> soft_limits;
};

/// A turntable moved by a motor drive: the logic of a move, for every kind of drive. A move has arrived when the drive
/// reports in position and its position is within the tolerance, both without a break for the settle time. rotate_to()
/// takes the angle modulo 360 degrees and turns the shorter way, ending counter-clockwise. `out_of_range` and
/// `not_homed` found before anything was sent leave home as it is. When the stop after a failure could not be
/// delivered, it is the first request sent once the drive replies again.
class AxisTurntable : public Turntable {
 public:
  Result<void> home(Deadline deadline) override;
  Result<Move> rotate_to(Degrees target, Deadline deadline) override;
  Result<void> stop(Deadline deadline) override;
  Result<void> reset_alarm(Deadline deadline) override;
  Result<TurntableStatus> status(Deadline deadline) override;
  Result<void> limit_speed(std::optional<DegreesPerSecond> limit) override;
  void request_stop() noexcept override;
  void drop_stop_request() noexcept override;

 protected:
  /// `reply_timeout`: the longest reply time of the drive. `counter`: the range that it can count.
  AxisTurntable(AxisTurntableOptions options, std::unique_ptr<AxisDrive> drive, Clock::Duration reply_timeout,
                MovePlanner::Counter counter, Clock& clock);

 private:
  enum class Seen { waiting, progress, done, home_lost };
  struct Arrival {
    Clock::TimePoint in_position;
    Clock::TimePoint still;
    std::int32_t position = 0;
  };
  /// `again`: time of the next poll of the drive, unless it is brought forward.
  using Look = std::function<Seen(const DriveState&, Clock::TimePoint& again)>;

  Result<void> find_home(Deadline deadline);
  Result<void> check_and_enable(Deadline deadline);
  Result<Move> turn(Degrees target, const DriveState& before, const MovePlan& plan, Deadline deadline);
  Result<Arrival> run_to(std::int32_t target, const DriveState& before, Clock::Duration settle, Deadline deadline);

  Result<void> command(const std::function<Result<void>()>& send, const std::function<bool(const DriveState&)>& obeyed,
                       Deadline deadline);
  Result<void> watch(std::string_view doing, const Look& look, Deadline deadline);
  Result<void> healthy(const DriveState& state, Deadline deadline);
  Result<void> not_stopped();
  Result<DriveState> ask(Deadline deadline);
  Result<DriveState> read_after_owed_stop(Deadline deadline);
  Result<void> stop_drive(Deadline deadline);
  tl::unexpected<Error> give_up(const Error& error);
  void pause(Clock::TimePoint until);

  [[nodiscard]] std::int32_t tolerance_pulses() const;
  [[nodiscard]] bool near(std::int32_t a, std::int32_t b) const;

  AxisTurntableOptions options_;
  MovePlanner planner_;
  Clock::Duration reply_timeout_;
  Clock& clock_;
  std::unique_ptr<AxisDrive> drive_;
  bool homed_ = false;
  bool backlash_taken_up_ = false;  // the last move ended counter-clockwise
  bool stop_pending_ = false;       // a stop could not be delivered

  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_requested_ = false;  // guarded by mutex_
};

}  // namespace scanrig
