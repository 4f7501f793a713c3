#pragma once

#include "core/clock.h"

namespace scanrig::sim {

/// The motion of the table as a function of time: a trapezoid of speed, then a decaying vibration. Angles in degrees.
/// No threads, no clock: the owner passes the time in.
class Axis {
 public:
  /// From its position at `now` (it must be stopped) to `target`, no faster than given.
  void go(double target, double speed_deg_s, Clock::TimePoint now);
  /// Brakes as hard as it accelerates.
  void brake(Clock::TimePoint now);
  /// Stops at once, wherever it is: blocked.
  void freeze(Clock::TimePoint now);
  /// Takes `degrees` off the count: the same position, another number.
  void rename(double degrees);

  [[nodiscard]] double angle(Clock::TimePoint now) const;
  /// When the trapezoid ends, and when the vibration has died out.
  [[nodiscard]] Clock::TimePoint arrival() const;
  [[nodiscard]] Clock::TimePoint still() const;

 private:
  struct State {
    double way = 0.0;    // deg from from_
    double speed = 0.0;  // deg/s, along the way
  };
  [[nodiscard]] State state(double seconds) const;

  Clock::TimePoint start_{};
  double from_ = 0.0;
  double rest_ = 0.0;  // position at the end
  double sign_ = 1.0;
  double first_speed_ = 0.0;                                    // deg/s at the start
  double accelerating_ = 0.0, cruising_ = 0.0, braking_ = 0.0;  // s
  bool vibrates_ = false;
};

}  // namespace scanrig::sim
