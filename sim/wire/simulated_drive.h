#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "core/clock.h"
#include "sim/wire/axis.h"

namespace scanrig::sim::wire {

/// A motor drive with its motor and table, whatever it speaks: what can go wrong with it, and what is true of it.
/// Threads: every function may be called from any thread.
class SimulatedDrive {
 public:
  virtual ~SimulatedDrive() = default;

  // Faults.
  void block(bool blocked);        ///< the shaft does not turn; the drive does not notice
  void lose_steps(double pulses);  ///< now
  void preload_counter(std::int32_t value);
  void set_physics(const AxisOptions& options);  ///< as Axis::set_physics()
  virtual void raise_alarm(std::uint16_t code, bool can_be_reset) = 0;
  void raise_alarm(std::uint16_t code) { raise_alarm(code, true); }
  virtual void power_cycle() = 0;
  /// Another master on the bus moves the table this far, slowly, without the driver's knowledge.
  virtual void send(std::int32_t pulses) = 0;

  // Truth.
  [[nodiscard]] AxisTruth truth() const;
  [[nodiscard]] std::vector<AxisLeg> legs() const;
  [[nodiscard]] std::int32_t counter() const;

 protected:
  SimulatedDrive(const AxisOptions& axis, Clock& clock)
      : clock_(clock), pulses_per_motor_rev_(axis.pulses_per_motor_rev), axis_(axis, clock.now()) {}
  /// Advances the axis and what follows from it; with `mutex_` held.
  void refresh() const;
  /// What happens to the axis by itself before `now`, other than its motion.
  virtual void pass_time(Clock::TimePoint /*now*/) const {}
  /// What follows from an axis that has moved on.
  virtual void follow() const {}

  Clock& clock_;
  const double pulses_per_motor_rev_;
  mutable std::mutex mutex_;
  mutable Axis axis_;
};

}  // namespace scanrig::sim::wire
