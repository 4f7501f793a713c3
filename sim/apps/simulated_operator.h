#pragma once

#include <thread>

#include "core/clock.h"
#include "sim/devices/sim_rig.h"

namespace scanrig::sim {

/// Simulated operator who watches only the lamps: turns the object over and presses Start each time the flip lamp
/// lights. Alone the operator also presses Reset once and Start once. As a helper the operator starts no job, but fixes
/// any fault of the rig and presses Reset whenever it is requested.
class Operator {
 public:
  enum class Role { alone, helper };
  Operator(SimRig& rig, Clock& clock, Role role)
      : rig_(rig), clock_(clock), role_(role), thread_([this](const std::stop_token& stop) { run(stop); }) {}

 private:
  void run(const std::stop_token& stop);
  void look(const PanelOutputs& lamps);
  void reset();

  SimRig& rig_;
  Clock& clock_;
  Role role_;
  bool has_reset_ = false;
  bool has_started_ = false;
  bool flip_was_requested_ = false;
  std::jthread thread_;  ///< last: joined before the other members are destroyed
};

}  // namespace scanrig::sim
