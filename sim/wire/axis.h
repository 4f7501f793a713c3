#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/clock.h"

namespace scanrig::sim::wire {

struct AxisOptions {
  double pulses_per_motor_rev = 10000;
  double gear_ratio = 90;       ///< motor turns per table turn
  double backlash_deg = 0.3;    ///< play between motor and table, at the table
  double start_deg = 137.0;     ///< of the table when switched on, from the home switch
  double vibration_deg = 0.05;  ///< of the table, when a motion ends; over after five times the decay
  double vibration_decay_s = 0.015;
  double vibration_hz = 25.0;
  double encoder_step_deg = 0;  ///< at the table; 0: every pulse is read
  /// Distance from the commanded angle (from home, at the table) to the motor's rest position; empty: none.
  std::function<double(double sent_to_deg)> rest_error_deg{};
};

/// Parameters of a motion, in motor units.
struct AxisMotion {
  double speed = 0;         ///< pulses/s
  double acceleration = 0;  ///< pulses/s^2
  double deceleration = 0;
};

/// True state of the axis, whatever the drive reports.
struct AxisTruth {
  double table_deg = 0;    ///< from the home switch, positive pulses positive, many turns wide
  double speed_deg_s = 0;  ///< of the motor, at the table
  bool moving = false;     ///< the motor runs or the table still shakes
};

/// One completed motion.
struct AxisLeg {
  double from_deg = 0;
  double to_deg = 0;
  Clock::TimePoint begun;
  Clock::TimePoint ended;
};

/// Motor, gear with play, table. Turned in the positive direction the table follows the motor exactly, turned back it
/// lags behind by the play. A step motor: its command and its position differ when it is blocked or loses steps.
/// Computed in steps of half a millisecond up to the current time.
/// Threads: one user at a time.
class Axis {
 public:
  Axis(const AxisOptions& options, Clock::TimePoint now);

  void advance(Clock::TimePoint now);

  void move_to(std::int32_t counter, const AxisMotion& motion);  ///< absolute, in counter values
  void seek_home(
      const AxisMotion& motion);  ///< negative, until the switch closes; first away from a closed one; then counter = 0
  void quick_stop();
  void slow_down();                           ///< to standstill, at the deceleration of the motion
  void set_counter(std::int32_t value);       ///< defines the current position
  void follow_motor() { command_ = motor_; }  ///< a closed loop: lost steps do not count as done

  void block(bool blocked) { blocked_ = blocked; }
  /// Play and vibration as in `options` from now on; gear and start are unchanged.
  void set_physics(const AxisOptions& options);
  void lose_steps(double pulses) { motor_ -= pulses; }

  [[nodiscard]] bool running() const { return mode_ != Mode::stopped; }
  [[nodiscard]] bool reached_switch() const { return reached_switch_; }  ///< by the last seek_home()
  [[nodiscard]] std::int32_t commanded() const;
  [[nodiscard]] std::int32_t measured() const;
  [[nodiscard]] AxisTruth truth() const;
  [[nodiscard]] const std::vector<AxisLeg>& legs() const { return legs_; }

 private:
  enum class Mode { stopped, moving, backing_off, seeking_home, stopping, slowing };

  void begin(Mode mode, const AxisMotion& motion);
  void step();
  void finish();
  void end();
  [[nodiscard]] double pulses_per_degree() const;
  [[nodiscard]] double turn() const;       ///< of the table, pulses
  [[nodiscard]] double vibration() const;  ///< deg
  [[nodiscard]] double off_deg() const { return rest_error_ + vibration(); }

  AxisOptions options_;
  Clock::TimePoint now_;
  Clock::TimePoint ended_;
  Mode mode_ = Mode::stopped;
  AxisMotion motion_;
  double velocity_ = 0;  // pulses/s
  double command_ = 0;   // commanded position of the motor, pulses
  double goal_ = 0;
  double rest_error_ = 0;    // deg at the table; of a stopped motor
  double motor_ = 0;         // its position
  double table_ = 0;         // in motor pulses
  double counter_zero_ = 0;  // command_ at which the counter reads 0
  bool blocked_ = false;
  bool reached_switch_ = false;
  bool shaking_ = false;
  std::vector<AxisLeg> legs_;
};

}  // namespace scanrig::sim::wire
