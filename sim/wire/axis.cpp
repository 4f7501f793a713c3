#include "sim/wire/axis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanrig::sim::wire {
namespace {

constexpr std::chrono::microseconds kStep{500};
constexpr double kStepSeconds = std::chrono::duration<double>(kStep).count();
constexpr double kQuickStopFactor = 4.0;
constexpr double kStillDeg = 0.001;
constexpr double kDecays = 5.0;      ///< of a vibration, until its end
constexpr double kBackOffDeg = 2.0;  ///< closer than this the home switch is already closed

/// Two's complement, as the drive's counter wraps.
std::int32_t wrapped(double pulses) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::int64_t>(std::llround(pulses))));
}

}  // namespace

Axis::Axis(const AxisOptions& options, Clock::TimePoint now) : options_(options), now_(now), ended_(now) {
  motor_ = command_ = table_ = counter_zero_ = options.start_deg * pulses_per_degree();
}

double Axis::pulses_per_degree() const { return options_.pulses_per_motor_rev * options_.gear_ratio / 360.0; }

double Axis::turn() const { return 360.0 * pulses_per_degree(); }

void Axis::advance(Clock::TimePoint now) {
  while (running() && now_ + kStep <= now) {
    now_ += kStep;
    step();
  }
  if (!running()) now_ = std::max(now_, now);
}

void Axis::begin(Mode mode, const AxisMotion& motion) {
  if (running()) end();
  mode_ = mode;
  motion_ = motion;
  legs_.push_back({truth().table_deg, truth().table_deg, now_, now_});
  rest_error_ = 0.0;
}

void Axis::move_to(std::int32_t counter, const AxisMotion& motion) {
  begin(Mode::moving, motion);
  goal_ = command_ + (static_cast<double>(counter) - commanded());
}

void Axis::seek_home(const AxisMotion& motion) {
  const double beyond_switch = motor_ - std::floor(motor_ / turn()) * turn();
  const double near = kBackOffDeg * pulses_per_degree();
  const bool on_switch = beyond_switch < near || beyond_switch > turn() - near;
  begin(on_switch ? Mode::backing_off : Mode::seeking_home, motion);
  goal_ = motor_ + (on_switch ? 2.0 * near : -beyond_switch);
  reached_switch_ = false;
}

void Axis::quick_stop() {
  if (running()) mode_ = Mode::stopping;
}

void Axis::slow_down() {
  if (running() && mode_ != Mode::stopping) mode_ = Mode::slowing;
}

void Axis::set_counter(std::int32_t value) {
  command_ = motor_;
  counter_zero_ = command_ - value;
}

void Axis::set_physics(const AxisOptions& options) {
  options_.backlash_deg = options.backlash_deg;
  options_.vibration_deg = options.vibration_deg;
  options_.vibration_decay_s = options.vibration_decay_s;
}

void Axis::step() {
  const bool by_switch = mode_ == Mode::backing_off || mode_ == Mode::seeking_home;
  const double left = goal_ - (by_switch ? motor_ : command_);
  double wanted = 0.0;
  const bool ending = mode_ == Mode::stopping || mode_ == Mode::slowing;
  double change = motion_.deceleration * (mode_ == Mode::slowing ? 1.0 : kQuickStopFactor) * kStepSeconds;
  if (!ending) {
    // The highest speed from which steps of equal deceleration end on the goal.
    const double slower = motion_.deceleration * kStepSeconds;
    const double steps = std::sqrt(0.25 + 2.0 * std::abs(left) / (slower * kStepSeconds)) - 0.5;
    wanted = std::copysign(std::min(motion_.speed, steps * slower), left);
    change = (std::abs(wanted) > std::abs(velocity_) ? motion_.acceleration : motion_.deceleration) * kStepSeconds;
  }
  velocity_ += std::clamp(wanted - velocity_, -change, change);
  double way = velocity_ * kStepSeconds;
  const bool there = !ending && way * left >= left * left;
  if (there) way = left;
  command_ += way;
  if (!blocked_) motor_ += way;
  table_ = std::clamp(table_, motor_, motor_ + options_.backlash_deg * pulses_per_degree());
  if (ending ? velocity_ == 0.0 : there && !(by_switch && blocked_)) finish();
}

void Axis::finish() {
  if (mode_ == Mode::backing_off) {
    velocity_ = 0.0;
    mode_ = Mode::seeking_home;
    goal_ = std::round(motor_ / turn()) * turn();
    return;
  }
  if (mode_ == Mode::seeking_home) {
    reached_switch_ = true;
    set_counter(0);
  } else if (mode_ == Mode::moving && options_.rest_error_deg && !blocked_) {
    rest_error_ = options_.rest_error_deg((command_ - counter_zero_) / pulses_per_degree());
  }
  end();
}

void Axis::end() {
  mode_ = Mode::stopped;
  velocity_ = 0.0;
  ended_ = now_;
  shaking_ = !blocked_;
  legs_.back().to_deg = table_ / pulses_per_degree();
  legs_.back().ended = now_;
}

double Axis::vibration() const {
  if (running() || !shaking_) return 0.0;
  const double t = std::chrono::duration<double>(now_ - ended_).count();
  if (t >= kDecays * options_.vibration_decay_s) return 0.0;
  return options_.vibration_deg * std::exp(-t / options_.vibration_decay_s) *
         std::cos(2.0 * std::numbers::pi * options_.vibration_hz * t);
}

std::int32_t Axis::commanded() const { return wrapped(command_ - counter_zero_); }

std::int32_t Axis::measured() const {
  const double deg = (motor_ - counter_zero_) / pulses_per_degree() + off_deg();
  const double step = options_.encoder_step_deg;
  return wrapped((step > 0 ? step * std::round(deg / step) : deg) * pulses_per_degree());
}

AxisTruth Axis::truth() const {
  AxisTruth truth;
  truth.table_deg = table_ / pulses_per_degree() + off_deg();
  truth.speed_deg_s = blocked_ ? 0.0 : velocity_ / pulses_per_degree();
  const double t = std::chrono::duration<double>(now_ - ended_).count();
  const bool shakes = shaking_ && t < kDecays * options_.vibration_decay_s &&
                      options_.vibration_deg * std::exp(-t / options_.vibration_decay_s) > kStillDeg;
  truth.moving = running() ? !blocked_ : shakes;
  return truth;
}

}  // namespace scanrig::sim::wire
