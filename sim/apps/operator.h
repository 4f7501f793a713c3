#pragma once

#include <thread>

#include "core/clock.h"
#include "sim/devices/sim_rig.h"

namespace scanrig::sim {

/// Somebody at the simulated rig who looks at nothing but the lamps: presses Reset once, Start once, and turns the
/// object over and presses Start each time the flip lamp comes on.
class Operator {
 public:
  Operator(SimRig& rig, Clock& clock)
      : rig_(rig), clock_(clock), thread_([this](const std::stop_token& stop) { run(stop); }) {}

 private:
  void run(const std::stop_token& stop);
  void look(const PanelOutputs& lamps);

  SimRig& rig_;
  Clock& clock_;
  bool has_reset_ = false;
  bool has_started_ = false;
  bool flip_was_requested_ = false;
  std::jthread thread_;  ///< last: it is joined before the rest goes
};

}  // namespace scanrig::sim
