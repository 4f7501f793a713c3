#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "core/clock.h"
#include "sim/wire/axis.h"

namespace scanrig::sim::wire {

/// What every simulated drive can be made to suffer and be asked, whatever it speaks.
/// Threads: every function may be called from any thread.
class Mechanics {
 public:
  Mechanics(const AxisOptions& axis, Clock& clock) : options_(axis), clock_(clock), axis_(axis, clock.now()) {}
  virtual ~Mechanics() = default;

  // Faults.
  void block(bool blocked);        ///< the shaft does not turn; the drive does not notice
  void lose_steps(double pulses);  ///< now
  virtual void raise_alarm(std::uint16_t code, bool can_be_reset = true) = 0;
  virtual void power_cycle() = 0;
  /// The counter reads `value` where the table stands.
  void preload_counter(std::int32_t value);
  void set_physics(const AxisOptions& options);  ///< as Axis::set_physics()
  /// Somebody else sends the table on by `deg`, at 90 deg/s.
  void send_round(double deg);

  // Truth.
  [[nodiscard]] AxisTruth truth() const;
  [[nodiscard]] std::vector<AxisLeg> legs() const;
  [[nodiscard]] std::int32_t counter() const;

 protected:
  /// Advances the axis and all that follows it to now; with the mutex held.
  virtual void refresh() const = 0;

  const AxisOptions options_;
  Clock& clock_;
  mutable std::mutex mutex_;
  mutable Axis axis_;
};

}  // namespace scanrig::sim::wire
