#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "daemon/station/transition.h"

namespace scanrig {

/// What every rule of the station is made of: the state being changed, and the words for changing it.
class Machine {
 public:
  Machine(const StationState& state, const StationRules& rules) : rules_(rules) { step_.state = state; }

  Step take() && { return std::move(step_); }
  StationState& s() { return step_.state; }
  [[nodiscard]] const StationRules& rules() const { return rules_; }

  template <class SomeAction>
  void act(SomeAction action) {
    step_.actions.emplace_back(std::move(action));
  }
  template <class... Args>
  void refuse(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) {
    step_.refused = Error{code, fmt::format(text, std::forward<Args>(args)...)};
  }

  bool may_move();
  void enter(MachineState machine, std::string cause);
  void warn();
  void stop_rig();
  void close_job(JobState state, Error why);

  /// Stops what moves; only Reset at the panel leaves the state.
  void fault(std::string cause);
  /// The same for a device that failed: safe at once, but it has its name only when an e-stop would have been seen,
  /// because an e-stop takes the power away from drives and adapters too.
  void fault_unnamed(const Error& error);
  void name_fault();

  /// Why nothing may move now; null: it may.
  const char* unsafe();
  /// Refuses, and says why, unless e-stop and guard are known to be closed.
  bool safe_to_move();
  /// The same for whoever is not at the panel: he needs a guard between him and the table.
  bool remote_may_move(std::string_view what);
  /// Homing, after the warning.
  void begin_homing(std::string cause);
  /// After a restart, where a closed guard stands for Reset.
  void home_if_guarded();

 private:
  StationRules rules_;
  Step step_;
};

void ask_maintenance(Machine& m, const event::MaintenanceAsked& asked);
void reset_in_maintenance(Machine& m, Origin origin);
void stop_in_maintenance(Machine& m);
/// The warning is over: what was asked for begins.
void move_in_maintenance(Machine& m);

}  // namespace scanrig
