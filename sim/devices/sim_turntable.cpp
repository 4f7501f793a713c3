#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/devices/simulated_devices.h"
#include "sim/scene/profile.h"
#include "sim/scene/rest_error.h"

namespace scanrig::sim {
namespace {

constexpr double kMaxAngleDeg = 3600.0;  // deg either way

}  // namespace

SimTurntable::SimTurntable(SharedState& state) : state_(state), speed_(profile().speed_deg_s) {}

Result<void> SimTurntable::limit_speed(std::optional<DegreesPerSecond> limit) {
  const DegreesPerSecond full{profile().speed_deg_s};
  speed_ = std::min(full, limit.value_or(full)).value;
  return {};
}

/// Waits until `moment`; any event that ends a move ends the wait.
Result<void> SimTurntable::wait_for(std::unique_lock<std::mutex>& lock, Clock::TimePoint moment, Deadline deadline) {
  SharedState& b = state_;
  const auto disturbed = [&b] { return b.stop_requested || !b.estop_ok || b.stalled; };
  if (b.clock.wait_until(lock, b.changed, std::min(moment, deadline.at), disturbed)) {
    if (std::exchange(b.stop_requested, false)) return fail(ErrorCode::stopped, "turntable: stopped on request");
    if (!b.estop_ok) return fail(ErrorCode::device_alarm, "turntable: the drive has no power: release the e-stop");
    // Blocked: after two seconds without progress the driver gives up.
    b.axis.freeze(b.clock.now());
    const auto given_up = b.clock.now() + std::chrono::seconds(2);
    const auto called_off = [&b] { return b.stop_requested || !b.estop_ok; };
    if (b.clock.wait_until(lock, b.changed, std::min(given_up, deadline.at), called_off)) {
      return wait_for(lock, moment, deadline);
    }
    if (deadline.at < given_up) return fail(ErrorCode::timeout, "turntable: not at its target in time");
    return fail(ErrorCode::stalled, "turntable: does not move; remove what blocks the table");
  }
  if (deadline.at < moment) return fail(ErrorCode::timeout, "turntable: not at its target in time");
  return {};
}

Result<void> SimTurntable::travel(std::unique_lock<std::mutex>& lock, double target, Deadline deadline, Move& move) {
  SharedState& b = state_;
  const auto begin = b.clock.now();
  if (!b.stop_requested && b.estop_ok) {
    b.axis.go(resting_angle(target, b.scene->options().seed), speed_, begin);
  }
  auto done = wait_for(lock, b.axis.arrival(), deadline);
  const auto arrived = b.clock.now();
  if (done) done = wait_for(lock, b.axis.still(), deadline);
  if (!done) {
    b.axis.brake(b.clock.now());
    homed_ = false;
    return done;
  }
  move = {{target}, {encoder_reading(b.axis.angle(b.clock.now()))}, arrived - begin, b.clock.now() - arrived};
  return {};
}

Result<void> SimTurntable::home(Deadline deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  homed_ = false;
  // A table that still brakes is stopped first.
  if (auto stopped = wait_for(lock, b.axis.still(), deadline); !stopped) return stopped;
  const double turns = 360.0 * std::round(b.axis.angle(b.clock.now()) / 360.0);
  b.axis.rename(turns);
  Move move;
  const auto done = travel(lock, 0.0, deadline, move);
  homed_ = done.has_value();
  return done;
}

Result<Move> SimTurntable::rotate_to(Degrees target, Deadline deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  if (!b.stop_requested && !homed_) return fail(ErrorCode::not_homed, "turntable: not homed; home first");
  if (!(std::abs(target.value) <= kMaxAngleDeg)) {
    return fail(ErrorCode::out_of_range, "turntable: {} degrees is out of range; limit {} either way", target.value,
                kMaxAngleDeg);
  }
  Move move;
  if (const auto done = travel(lock, target.value, deadline, move); !done) return pass_on(done);
  return move;
}

Result<void> SimTurntable::stop(Deadline deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  b.axis.brake(b.clock.now());
  const auto standstill = b.axis.still();
  b.clock.wait_until(lock, b.changed, std::min(standstill, deadline.at), [] { return false; });
  if (deadline.at < standstill)
    return fail(ErrorCode::timeout, "turntable: standstill not confirmed in time; the table may be moving");
  return {};
}

Result<void> SimTurntable::reset_alarm(Deadline) {
  const std::scoped_lock lock(state_.mutex);
  if (!state_.estop_ok) return fail(ErrorCode::device_alarm, "turntable: the drive has no power: release the e-stop");
  return {};
}

Result<TurntableStatus> SimTurntable::status(Deadline) {
  const std::scoped_lock lock(state_.mutex);
  const auto now = state_.clock.now();
  TurntableStatus status;
  status.motion = now < state_.axis.still() ? TurntableStatus::Motion::moving : TurntableStatus::Motion::stopped;
  status.homed = homed_;
  status.angle = Degrees{encoder_reading(state_.axis.angle(now))};
  if (!state_.estop_ok) status.alarm = "no motor power: e-stop";
  return status;
}

void SimTurntable::request_stop() noexcept {
  const std::scoped_lock lock(state_.mutex);
  state_.stop_requested = true;
  state_.clock.notify_all(state_.changed);
}

void SimTurntable::drop_stop_request() noexcept {
  const std::scoped_lock lock(state_.mutex);
  state_.stop_requested = false;
}

}  // namespace scanrig::sim
