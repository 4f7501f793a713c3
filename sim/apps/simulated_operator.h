#pragma once

#include <atomic>
#include <thread>

#include "core/clock.h"
#include "sim/devices/sim_rig.h"

namespace scanrig::sim {

/// Simulated operator who watches the lamps: turns the object over and presses Start each time the flip lamp lights. In
/// a calibration the operator reads where the board goes, and puts it there instead. Alone the operator also presses
/// Reset once and Start once. As a helper the operator starts no job, but fixes any fault of the rig and presses Reset
/// whenever it is requested.
class Operator {
 public:
  enum class Role { alone, helper };
  Operator(SimRig& rig, Clock& clock, Role role)
      : rig_(rig), clock_(clock), role_(role), thread_([this](const std::stop_token& stop) { run(stop); }) {}

  /// What the screen says: placement that awaits the board, from 1, 0: none; whether a calibration is under way, for
  /// which the board stays. Threads: any.
  void read_screen(int awaited_placement, bool calibrates) {
    calibrates_ = calibrates;
    awaited_placement_ = awaited_placement;
  }

 private:
  void run(const std::stop_token& stop);
  void look(const PanelOutputs& lamps);
  void reset();

  SimRig& rig_;
  Clock& clock_;
  Role role_;
  bool has_reset_ = false;
  bool has_started_ = false;
  bool was_asked_ = false;
  std::atomic<int> awaited_placement_ = 0;
  std::atomic<bool> calibrates_ = false;
  std::jthread thread_;  ///< last: joined before the other members are destroyed
};

}  // namespace scanrig::sim
