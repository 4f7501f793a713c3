#include "sim/wire/mechanics.h"

#include <cmath>

namespace scanrig::sim::wire {

void Mechanics::block(bool blocked) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.block(blocked);
}

void Mechanics::lose_steps(double pulses) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.lose_steps(pulses);
}

void Mechanics::preload_counter(std::int32_t value) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.set_counter(value);
}

void Mechanics::set_physics(const AxisOptions& options) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.set_physics(options);
}

void Mechanics::send_round(double deg) {
  const std::scoped_lock lock(mutex_);
  refresh();
  const double per_degree = options_.pulses_per_motor_rev * options_.gear_ratio / 360.0;
  axis_.move_to(axis_.commanded() + static_cast<std::int32_t>(std::lround(deg * per_degree)),
                {90.0 * per_degree, 900.0 * per_degree, 900.0 * per_degree});
}

AxisTruth Mechanics::truth() const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return axis_.truth();
}

std::vector<AxisLeg> Mechanics::legs() const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return axis_.legs();
}

std::int32_t Mechanics::counter() const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return axis_.measured();
}

}  // namespace scanrig::sim::wire
