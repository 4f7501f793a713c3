#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/station/events.h"
#include "daemon/station/states.h"

namespace scanrig {

struct StationRules {
  std::map<std::string, Recipe> recipes{{"default", {}}};  ///< "default" is what Start scans when nothing is queued
  bool remote = false;                  ///< the API may start and home while the guard is closed; needs a guard
  bool guard = false;                   ///< there is a guard whose contact is wired
  bool auto_home = false;               ///< after a restart a closed guard homes the table, without Reset
  bool manual_light = false;            ///< the projector is switched by hand
  std::optional<Recipe> calibration{};  ///< how the rig is calibrated; nothing: this service cannot solve one
  bool accepts_calibrations = false;    ///< a calibration that grades becomes the rig's without a person
  bool lent = false;                    ///< setup has the devices: nothing moves, no job starts
};

constexpr DegreesPerSecond kMaxJogSpeed{10};

constexpr int kFailuresThatStop = 3;  ///< in a row: a fault of the automation, not of a part

/// A fault that only Reset at the panel clears, whatever restarts in between.
struct Latch {
  std::string cause;     ///< a sentence
  std::string device{};  ///< whose failure it is, as DeviceHealth names it; empty: none, as of an e-stop
  bool operator==(const Latch&) const = default;
};

/// The active job.
struct ActiveJob {
  std::string id;
  Recipe recipe{};
  std::string part{};       ///< from the order
  bool is_started = false;  ///< its folder is ready for views
  int pose = 0;
  int asked = 0;                          ///< views of this pose requested from the rig
  int taken = 0;                          ///< views whose four images are in memory
  int stored = 0;                         ///< views that survive a power cut
  bool movement_check_due = false;        ///< view 0 has to be taken again before anything else
  bool closing = false;                   ///< it is being taken or checked
  bool turned_over = false;               ///< the automation has reported it since the flip request
  bool turning = false;                   ///< to the mark of the placement that comes next
  std::string repeated{};                 ///< why this placement is to be taken again; empty: the next one is
  std::string image_problem{};            ///< of the last view with one, in this placement
  std::optional<Error> reconstruction{};  ///< why there will be no model
};

/// State while an engineer has the rig.
struct Maintenance {
  MachineState before = MachineState::halted;
  bool moved = false;  ///< something has moved outside a job
  bool homed = false;
  std::string requester{};           ///< who switched it on, as in event::MaintenanceRequested
  bool consent = false;              ///< to jog, by Reset at the panel; ends as docs/reference/safety.md lists
  bool guard_was_opened = false;     ///< since it began, and no Reset at the panel after it
  std::optional<action::Jog> jog{};  ///< starts when the warning is over

  /// True for a guard that stayed closed, or consent.
  [[nodiscard]] bool may_jog(bool has_guard) const { return consent || (has_guard && !guard_was_opened); }
};

struct StationState {
  MachineState machine = MachineState::preoperational;
  Activity activity = Activity::none;
  bool panel_known = false;  ///< e-stop and guard have been read
  bool estop_ok = true;
  bool guard_closed = true;
  std::optional<Latch> latch{};
  bool auto_home_allowed = true;        ///< only a restart came before
  std::optional<Error> unclassified{};  ///< a fault that may turn out to be the e-stop
  std::string fault_device{};           ///< the device of the last fault; empty: none, as of an e-stop
  std::optional<Maintenance> maintenance{};
  PanelInputs inputs{};
  std::optional<Error> panel_problem{};
  std::vector<DeviceHealth> devices{};      ///< as of the last check
  event::CalibrationChecked calibration{};  ///< likewise
  bool shutting_down = false;
  bool reloading = false;                          ///< shutting down to restart
  bool finished = false;                           ///< shut down, the rig commanded to stop
  bool may_be_moving = false;                      ///< the last stop was not confirmed
  bool has_no_alarm = false;                       ///< the drive's last report, or its homing, showed none
  std::optional<HungCall> hung{};                  ///< of turntable, projector or camera
  std::string cause = "The service has started.";  ///< why the machine is in this state
  std::optional<ActiveJob> job;
  std::string last_started_job{};  ///< the job that was active last; empty: none since the daemon started
  std::vector<std::shared_ptr<const JobInfo>> queue{};  ///< by place
  int failures = 0;                                     ///< scans in a row without a model that passes
  std::set<std::string> unjudged{};                     ///< scans whose outcome is still to come
  bool quiet = false;                                   ///< quiet hours: no job starts automatically
  std::chrono::seconds warm_up_left{0};                 ///< of the projector: until then likewise
  bool disk_trouble = false;                            ///< the job disk refused something; until a job starts
  std::optional<NotStarted> not_started{};              ///< by the last Start; until the next one
  std::optional<Error> disk_problem{};                  ///< it does not respond: nothing starts meanwhile
  bool part_gone = false;                               ///< the part of the last job was removed
  std::optional<double> table_deg{};                    ///< where the last motion ended; nothing: unknown
};

struct Step {
  StationState state{};
  std::vector<Action> actions{};
  std::optional<Error> refused{};  ///< a press that was refused; nothing has changed then
};

/// The job whose own calibration the next scan continues with; empty: it starts with the rig's.
std::string calibrated_job(const StationState& state);
/// Why the calibration refuses the next scan, as of the last check; null: it does not.
const Error* calibration_problem(const StationState& state);

/// The pose that the next Start begins or continues with.
int next_pose(const ActiveJob& job);
/// The placement, from 0, that the board is to be put at before the next Start; nothing: none is awaited.
std::optional<int> awaited_placement(const StationState& state);

/// What Start means now: another text when it means something else. A Start that carries an offer counts once.
std::string start_offer(const StationState& state);

/// The whole behaviour of the station as a pure function: the next state, and the actions.
/// Events that come too late for the state they belong to change nothing.
Step next(const StationState& state, const Event& event, const StationRules& rules);

}  // namespace scanrig
