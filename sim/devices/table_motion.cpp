#include "sim/devices/table_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

double seconds(Clock::Duration d) { return std::chrono::duration<double>(d).count(); }
Clock::Duration duration(double s) { return std::chrono::round<Clock::Duration>(std::chrono::duration<double>(s)); }

}  // namespace

Axis::State Axis::state(double t) const {
  const double a = profile().acceleration_deg_s2;
  const double t1 = std::clamp(t, 0.0, accelerating_);
  const double t2 = std::clamp(t - accelerating_, 0.0, cruising_);
  const double t3 = std::clamp(t - accelerating_ - cruising_, 0.0, braking_);
  const double peak = first_speed_ + a * t1;
  return {first_speed_ * t1 + 0.5 * a * t1 * t1 + peak * t2 + peak * t3 - 0.5 * a * t3 * t3, peak - a * t3};
}

void Axis::go(double target, double speed_deg_s, Clock::TimePoint now) {
  const Profile& p = profile();
  from_ = angle(now);
  rest_ = target;
  start_ = now;
  const double way = std::abs(target - from_);
  sign_ = target < from_ ? -1.0 : 1.0;
  first_speed_ = 0.0;
  const double peak = std::min(speed_deg_s, std::sqrt(way * p.acceleration_deg_s2));
  accelerating_ = braking_ = peak / p.acceleration_deg_s2;
  cruising_ = peak > 0.0 ? way / peak - accelerating_ : 0.0;
  vibrates_ = way > 0.0;
}

void Axis::brake(Clock::TimePoint now) {
  if (now >= arrival()) return;
  const State s = state(seconds(now - start_));
  from_ += sign_ * s.way;
  start_ = now;
  first_speed_ = s.speed;
  accelerating_ = cruising_ = 0.0;
  braking_ = s.speed / profile().acceleration_deg_s2;
  rest_ = from_ + sign_ * 0.5 * s.speed * braking_;
}

void Axis::freeze(Clock::TimePoint now) {
  from_ = rest_ = angle(now);
  start_ = now;
  first_speed_ = accelerating_ = cruising_ = braking_ = 0.0;
  vibrates_ = false;
}

void Axis::rename(double degrees) {
  from_ -= degrees;
  rest_ -= degrees;
}

double Axis::angle(Clock::TimePoint now) const {
  const double position = now < arrival() ? from_ + sign_ * state(seconds(now - start_)).way : rest_;
  const double since = seconds(now - arrival());
  if (!vibrates_ || since < 0.0 || now >= still()) return position;
  constexpr double kFrequency = 18.0;  // Hz, of an object on its table
  const double fading = std::exp(-5.0 * since / profile().settling_s);
  return position + profile().vibration_deg * fading * std::sin(2.0 * std::numbers::pi * kFrequency * since);
}

Clock::TimePoint Axis::arrival() const { return start_ + duration(accelerating_ + cruising_ + braking_); }

Clock::TimePoint Axis::still() const {
  return arrival() + (vibrates_ ? duration(profile().settling_s) : duration(0.0));
}

}  // namespace scanrig::sim
