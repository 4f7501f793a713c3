#include "sim/wire/simulated_drive.h"

namespace scanrig::sim::wire {

void SimulatedDrive::refresh() const {
  const auto now = clock_.now();
  pass_time(now);
  axis_.advance(now);
  follow();
}

void SimulatedDrive::block(bool blocked) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.block(blocked);
}

void SimulatedDrive::lose_steps(double pulses) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.lose_steps(pulses);
}

void SimulatedDrive::preload_counter(std::int32_t value) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.set_counter(value);
}

void SimulatedDrive::set_physics(const AxisOptions& options) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.set_physics(options);
}

AxisTruth SimulatedDrive::truth() const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return axis_.truth();
}

std::vector<AxisLeg> SimulatedDrive::legs() const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return axis_.legs();
}

std::int32_t SimulatedDrive::counter() const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return axis_.measured();
}

}  // namespace scanrig::sim::wire
