#include "drivers/turntable/axis_turntable.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>
#include <utility>

namespace scanrig {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPollPeriod{5};  ///< between a reply and the next request
constexpr milliseconds kStalledAfter{2000};
constexpr milliseconds kEnableTime{1000};
/// The table is stopped when the position has not changed for this long: longer than a table rings after a quick stop.
constexpr milliseconds kStandingTime{100};
constexpr int kAttempts = 3;
/// Three attempts of five each: a reply may come two late, the line is quiet for two after it, the next one takes
/// one. The rest is margin, for a reset too.
constexpr int kStopReplyTimeouts = 20;

}  // namespace

AxisTurntable::AxisTurntable(AxisTurntableOptions options, std::unique_ptr<AxisDrive> drive,
                             Clock::Duration reply_timeout, MovePlanner::Counter counter, Clock& clock)
    : options_(std::move(options)),
      planner_{options_.scale, options_.backlash, options_.tolerance, options_.soft_limits, counter},
      reply_timeout_(reply_timeout),
      clock_(clock),
      drive_(std::move(drive)) {}

std::int32_t AxisTurntable::tolerance_pulses() const {
  return std::max(1, static_cast<std::int32_t>(options_.tolerance.value * options_.scale.pulses_per_degree()));
}

bool AxisTurntable::near(std::int32_t a, std::int32_t b) const {
  return std::abs(std::int64_t{a} - std::int64_t{b}) <= tolerance_pulses();
}

Result<void> AxisTurntable::home(Deadline deadline) {
  homed_ = backlash_taken_up_ = false;
  if (auto found = find_home(deadline); !found) return give_up(found.error());
  if (auto off = drive_->guard_connection(false, deadline); !off) return give_up(off.error());
  homed_ = true;
  return {};
}

Result<void> AxisTurntable::find_home(Deadline deadline) {
  if (auto ready = check_and_enable(deadline); !ready) return ready;
  auto before = ask(deadline);
  if (!before) return pass_on(before);

  const bool here = options_.home_mode == "here";
  if (!here) {
    if (auto prepared = drive_->prepare_homing(deadline); !prepared) return prepared;
  }
  if (auto on = drive_->guard_connection(true, deadline); !on) return on;
  // Where homing searches for the zero, the homed bit may still be that of the last homing: a change must be seen.
  const bool sought = !here && !drive_->knows_zero();
  bool begun = false;
  const auto begins = [&](const DriveState& state) {
    begun = begun || state.running || (sought ? before->homed && !state.homed : near(state.position, 0));
    return begun;
  };
  const auto started =
      command([&] { return here ? drive_->set_zero(deadline) : drive_->start_homing(deadline); }, begins, deadline);
  if (!started) return started;

  std::int32_t anchor = before->position;
  auto still_since = clock_.now();
  const auto homed = watch(
      "homing",
      [&](const DriveState& state, Clock::TimePoint&) {
        const bool at_home = begins(state) && state.homed && !state.running && near(state.position, 0);
        const bool moved = !near(state.position, anchor);
        if (moved) anchor = state.position;
        if (!at_home || moved) still_since = clock_.now();
        if (clock_.now() - still_since >= options_.settle && at_home) return Seen::done;
        return moved || at_home || state.blind ? Seen::progress : Seen::waiting;
      },
      deadline);
  if (!homed) return homed;
  if (!options_.soft_limits) return {};
  return drive_->set_soft_limits(planner_.counter_range(), deadline);
}

Result<void> AxisTurntable::check_and_enable(Deadline deadline) {
  auto state = ask(deadline);
  if (!state) return pass_on(state);
  if (state->running) {
    if (auto stopped = stop(deadline); !stopped) return stopped;
  }
  if (state->fault) return healthy(*state, deadline);  // with an alarm a device may reply to nothing else
  if (auto fit = drive_->check(deadline); !fit) return fit;
  if (state = ask(deadline); !state) return pass_on(state);
  if (!state->fault && !state->enabled) {
    if (auto enabled = drive_->enable(deadline); !enabled) return enabled;
    for (const auto by = deadline.at_most(clock_, kEnableTime); !state->enabled && !by.expired(clock_);) {
      if (state = ask(deadline); !state) return pass_on(state);
    }
  }
  return healthy(*state, deadline);
}

Result<Move> AxisTurntable::rotate_to(Degrees target, Deadline deadline) {
  if (auto free = not_stopped(); !free) return give_up(free.error());
  if (!homed_) return fail(ErrorCode::not_homed, "turntable: not homed; home first");
  const auto before = ask(deadline);
  if (!before) return give_up(before.error());
  if (auto fit = healthy(*before, deadline); !fit) return give_up(fit.error());
  const auto plan = planner_.plan(before->position, target, backlash_taken_up_);
  if (!plan) {
    return fail(ErrorCode::out_of_range, "turntable: {} deg cannot be reached within the soft limits", target.value);
  }
  auto move = turn(target, *before, *plan, deadline);
  if (!move) return give_up(move.error());
  return move;
}

Result<Move> AxisTurntable::turn(Degrees target, const DriveState& before, const MovePlan& plan, Deadline deadline) {
  const auto begun = clock_.now();
  if (before.running || !before.homed) {
    return before.running ? fail(ErrorCode::protocol, "the table moves although nothing was commanded")
                          : fail(ErrorCode::not_homed, "the drive has lost its home (switched off in between?)");
  }
  if (auto on = drive_->guard_connection(true, deadline); !on) return pass_on(on);
  backlash_taken_up_ = false;
  DriveState state = before;
  if (plan.before) {
    const auto passed = run_to(*plan.before, state, Clock::Duration::zero(), deadline);
    if (!passed) return pass_on(passed);
    state.position = passed->position;
  }
  const auto arrival = run_to(plan.target, state, options_.settle, deadline);
  if (!arrival) return pass_on(arrival);
  if (auto off = drive_->guard_connection(false, deadline); !off) return pass_on(off);
  backlash_taken_up_ = true;
  const Degrees measured = options_.scale.angle(arrival->position);
  return Move{target, target + Degrees{std::remainder((measured - target).value, 360.0)}, arrival->in_position - begun,
              arrival->still - arrival->in_position};
}

Result<AxisTurntable::Arrival> AxisTurntable::run_to(std::int32_t target, const DriveState& before,
                                                     Clock::Duration settle, Deadline deadline) {
  const auto sent =
      command([&] { return drive_->start_move(target, deadline); },
              [&](const DriveState& state) {
                return state.running || near(state.position, target) || !near(state.position, before.position);
              },
              deadline);
  if (!sent) return pass_on(sent);

  Arrival arrival;
  std::optional<Clock::TimePoint> in_position;
  std::int64_t min_left = std::abs(std::int64_t{target} - before.position);
  const auto arrived = watch(
      fmt::format("turning to {:.2f} deg", options_.scale.angle(target).value),
      [&](const DriveState& state, Clock::TimePoint& again) {
        if (!state.homed) return Seen::home_lost;
        const auto now = clock_.now();
        const std::int64_t left = std::abs(std::int64_t{target} - state.position);
        const bool nearer = left + tolerance_pulses() <= min_left;
        if (nearer) min_left = left;
        if (state.running || !state.in_position || !near(state.position, target)) {
          in_position.reset();
          return nearer ? Seen::progress : Seen::waiting;
        }
        if (!in_position) in_position = now;
        if (now - *in_position < settle) {
          again = std::min(again, *in_position + settle);  // not one period too late
          return Seen::progress;
        }
        arrival = {*in_position, now, state.position};
        return Seen::done;
      },
      deadline);
  if (!arrived) return pass_on(arrived);
  return arrival;
}

/// Sends a request that starts a motion. When the reply is missed, the drive's state is checked before the request is
/// sent again.
Result<void> AxisTurntable::command(const std::function<Result<void>()>& send,
                                    const std::function<bool(const DriveState&)>& obeyed, Deadline deadline) {
  for (int attempt = 1;; ++attempt) {
    auto sent = send();
    if (sent || !drive_->reply_missed() || sent.error().code == ErrorCode::io) return sent;
    const auto state = ask(deadline);
    if (!state) return pass_on(state);
    if (obeyed(*state)) return {};
    if (attempt == kAttempts) return sent;
    drive_->count_retry();
  }
}

/// Polls until `look` returns done. Fails with `stopped`, `not_homed`, `device_alarm`, `stalled`, `timeout`, `io`,
/// `protocol`.
Result<void> AxisTurntable::watch(std::string_view doing, const Look& look, Deadline deadline) {
  for (auto last_progress = clock_.now();;) {
    const auto state = ask(deadline);
    if (!state) return pass_on(state);
    if (auto fit = healthy(*state, deadline); !fit) return fit;
    auto again = clock_.now() + kPollPeriod;
    const Seen seen = look(*state, again);
    if (seen == Seen::done) return {};
    if (seen == Seen::home_lost) {
      return fail(ErrorCode::not_homed, "{}: the drive has lost its home (switched off, reset?)", doing);
    }
    if (seen == Seen::progress) last_progress = clock_.now();
    if (clock_.now() - last_progress >= kStalledAfter) {
      return fail(ErrorCode::stalled, "{}: no progress for 2 s, the axis reads {:.3f} deg; is something in the way?",
                  doing, options_.scale.angle(state->position).value);
    }
    // A blind drive's state is unknown: there must be time left for a stop that gets no reply.
    const auto for_stop = state->blind ? kStopReplyTimeouts * reply_timeout_ : Clock::Duration::zero();
    if (deadline.left(clock_) <= for_stop) {
      return fail(ErrorCode::timeout, "{}: not at the target by the deadline, the axis reads {:.3f} deg", doing,
                  options_.scale.angle(state->position).value);
    }
    pause(again);
  }
}

Result<void> AxisTurntable::healthy(const DriveState& state, Deadline deadline) {
  if (state.fault) {
    const auto alarm = drive_->read_alarm(deadline);
    if (!alarm) return pass_on(alarm);
    return fail(ErrorCode::device_alarm, "the drive reports {}", alarm->empty() ? "a fault without a code" : *alarm);
  }
  if (!state.enabled) {
    return fail(ErrorCode::device_alarm, "the drive is switched off; check the emergency stop and the motor's power");
  }
  return {};
}

Result<void> AxisTurntable::not_stopped() {
  const std::scoped_lock lock(mutex_);
  if (stop_requested_) return fail(ErrorCode::stopped, "stopped on request");
  return {};
}

/// Reads the drive's state, unless a stop was requested.
Result<DriveState> AxisTurntable::ask(Deadline deadline) {
  if (auto free = not_stopped(); !free) return pass_on(free);
  return read_after_owed_stop(deadline);
}

Result<DriveState> AxisTurntable::read_after_owed_stop(Deadline deadline) {
  if (stop_pending_) {
    if (auto told = drive_->stop(deadline); !told) return pass_on(told);
    stop_pending_ = false;
  }
  return drive_->read_state(deadline);
}

Result<void> AxisTurntable::stop_drive(Deadline deadline) {
  drive_->stop_without_reply();
  drive_->set_fail_fast(false);
  return drive_->stop(deadline);
}

/// After any failure: the table is not homed, and a stop is sent to the motor.
tl::unexpected<Error> AxisTurntable::give_up(const Error& error) {
  homed_ = backlash_taken_up_ = false;
  ErrorCode code = error.code;
  if (code == ErrorCode::stopped || code == ErrorCode::timeout) {
    // A stop request aborts waiting requests: that is not a time-out.
    const std::scoped_lock lock(mutex_);
    if (std::exchange(stop_requested_, false)) code = ErrorCode::stopped;
  }
  stop_pending_ = !stop_drive(Deadline::after(clock_, kStopReplyTimeouts * reply_timeout_));
  return fail(code, "turntable: {}; {}", error.message,
              stop_pending_ ? "the stop was not confirmed: the table may be moving" : "the motor was told to stop");
}

/// Waits until the next poll is due or a stop is requested.
void AxisTurntable::pause(Clock::TimePoint until) {
  std::unique_lock lock(mutex_);
  clock_.wait_until(lock, wake_, until, [&] { return stop_requested_; });
}

Result<void> AxisTurntable::stop(Deadline deadline) {
  const auto failed = [&](const Error& error) {
    stop_pending_ = true;
    return tl::unexpected(Error{error.code, error.message + "; the table may be moving"}.in("turntable"));
  };
  if (auto told = stop_drive(deadline); !told) return failed(told.error());
  stop_pending_ = false;
  backlash_taken_up_ = false;
  auto since = clock_.now();
  for (std::optional<std::int32_t> last; !deadline.expired(clock_); pause(clock_.now() + kPollPeriod)) {
    const auto state = drive_->read_state(deadline);
    if (!state) return failed(state.error());
    if (state->running || !last || !near(*last, state->position)) {
      since = clock_.now();
      last = state->position;
    } else if (clock_.now() - since >= kStandingTime) {
      std::ignore = drive_->guard_connection(false, deadline);  // or the drive raises an alarm later, at standstill
      return {};
    }
  }
  return failed({ErrorCode::timeout, "stop: standstill not confirmed in time"});
}

Result<void> AxisTurntable::reset_alarm(Deadline deadline) {
  auto state = read_after_owed_stop(deadline);
  if (!state) return pass_on(state, "turntable");
  if (!state->fault) return {};
  if (auto reset = drive_->reset_alarm(deadline); !reset) return pass_on(reset, "turntable");
  if (state = drive_->read_state(deadline); !state) return pass_on(state, "turntable");
  if (!state->fault) return {};
  const auto alarm = drive_->read_alarm(deadline);
  if (!alarm) return pass_on(alarm, "turntable");
  return fail(ErrorCode::device_alarm, "turntable: the alarm stays: {}; remove its cause", *alarm);
}

Result<TurntableStatus> AxisTurntable::status(Deadline deadline) {
  const auto state = read_after_owed_stop(deadline);
  if (!state) return pass_on(state, "turntable");
  TurntableStatus status;
  status.motion = state->running ? TurntableStatus::Motion::moving : TurntableStatus::Motion::stopped;
  status.homed = homed_ && state->homed;
  if (status.homed) status.angle = options_.scale.angle(state->position);
  if (state->fault) {
    const auto alarm = drive_->read_alarm(deadline);
    if (!alarm) return pass_on(alarm, "turntable");
    status.alarm = alarm->empty() ? "a fault without a code" : *alarm;
  }
  return status;
}

Result<void> AxisTurntable::limit_speed(std::optional<DegreesPerSecond> limit) {
  const auto set = drive_->set_speed(std::min(options_.speed, limit.value_or(options_.speed)));
  if (!set) return pass_on(set, "turntable");
  return {};
}

void AxisTurntable::request_stop() noexcept {
  {
    const std::scoped_lock lock(mutex_);
    stop_requested_ = true;
  }
  drive_->set_fail_fast(true);
  clock_.notify_all(wake_);
}

void AxisTurntable::drop_stop_request() noexcept {
  const std::scoped_lock lock(mutex_);
  stop_requested_ = false;
}

}  // namespace scanrig
