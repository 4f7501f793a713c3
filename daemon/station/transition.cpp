#include "daemon/station/transition.h"

#include "daemon/station/machine.h"

namespace scanrig {
namespace {

class Transition : public Machine {
 public:
  using Machine::Machine;

  void operator()(const event::PanelFound& e) {
    s().panel_known = true;
    s().panel_problem.reset();
    s().estop_ok = e.estop_ok;
    s().guard_closed = e.guard_closed;
    if (s().machine == MachineState::preoperational) {
      s().machine = MachineState::halted;
      stop_rig();
    }
    if (!e.estop_ok && !s().latched) fault("The e-stop is pressed.");
  }

  void operator()(const event::InputsSeen& e) { inputs_seen(*this, e.inputs); }

  void operator()(const event::Pressed& e) {
    if (s().shutting_down) return refuse(ErrorCode::refused, "The daemon is shutting down.");
    const bool remote = e.origin == Origin::remote;
    switch (e.button) {
      case Button::start:
        if (remote && !remote_may_move("start")) return;
        return start(e.fresh_job_id);
      case Button::stop: return s().maintenance ? stop_in_maintenance(*this) : stop();
      case Button::reset:
        if (s().maintenance) return reset_in_maintenance(*this, e.origin);
        if (remote && !remote_may_move("reset")) return;
        return reset(e.origin);
    }
  }

  void operator()(const event::EstopChanged& e) {
    s().estop_ok = e.ok;
    if (!e.ok) return fault("The e-stop was pressed.");
    home_if_guarded();
  }

  void operator()(const event::GuardChanged& e) {
    s().guard_closed = e.closed;
    if (!e.closed && may_move()) return fault("The guard was opened while the table was moving.");
    home_if_guarded();
    serve_line(*this);
  }

  void operator()(const event::WarningOver&) {
    if (s().activity != Activity::warning) return;
    if (s().maintenance) return move_in_maintenance(*this);
    if (s().machine == MachineState::initialized) {
      s().activity = Activity::homing;
      act(action::Home{});
    } else {
      s().activity = Activity::scanning;
      take_next_view(*this);
    }
  }

  void operator()(const event::Homed&) {
    if (s().activity != Activity::homing) return;
    if (s().maintenance) s().maintenance->homed = true;
    enter(s().maintenance ? MachineState::maintenance : MachineState::ready, "The table is homed.");
  }

  void operator()(const event::Jogged& e) {
    if (s().activity != Activity::jogging) return;
    s().maintenance->jog.reset();
    enter(MachineState::maintenance, fmt::format("The table stands at {:.3f} deg.", e.measured.value));
  }

  void operator()(const event::Pulsed&) {
    if (s().activity == Activity::pulsing) enter(MachineState::maintenance, "The projector has flashed.");
  }

  void operator()(const event::MaintenanceAsked& e) { ask_maintenance(*this, e); }

  void operator()(const event::EstopWindowOver&) { name_fault(); }

  /// Where nobody knows whether the table moves, stop is asked for again and again: the first frame that gets through.
  void operator()(const event::StopRetryDue&) {
    if (s().may_be_moving && s().activity == Activity::none && !s().shutting_down) act(action::StopRig{});
  }

  /// Asking devices is for quiet times only.
  void operator()(const event::CheckDue&) {
    const bool standing = s().activity == Activity::none || s().activity == Activity::waiting_for_part;
    if (standing && !s().may_be_moving && !s().shutting_down) {
      check();
    } else {
      act(action::CheckLater{});
    }
  }

  void operator()(const event::DevicesSeen& e) {
    s().devices = e.devices;
    act(action::CheckLater{});
    serve_line(*this);
  }

  void operator()(const event::CalibrationSeen& e) {
    s().calibration = e;
    serve_line(*this);
  }

  void operator()(const event::QuietHours& e) {
    s().quiet = e.quiet;
    serve_line(*this);
  }

  void operator()(const event::WarmingUp& e) {
    s().warm_up_left = e.left;
    serve_line(*this);
  }

  /// A projector that cannot be reached is an absent device; it does not make the table move.
  void operator()(const event::Stopped& e) {
    s().may_be_moving = false;
    if (e.light) set_problem("projector", *e.light);
    stopped();
    if (!s().shutting_down) check();  // what is wrong is shown before somebody presses Start
    home_if_guarded();
  }

  void operator()(const event::RigFailed& e) {
    if (s().activity == Activity::stopping || s().machine == MachineState::error) return;  // cut short by the stop
    fault_unnamed(e);
  }

  /// The first cause stays: an e-stop is an e-stop, whatever a drive without power answers.
  void operator()(const event::StopFailed& e) {
    if (s().machine != MachineState::error) {
      s().cause = fmt::format("The table may be moving: {}.", e.error.message);
      s().fault_device = "turntable";
    }
    s().machine = MachineState::error;
    s().latched = true;
    s().home_by_guard = false;
    s().maintenance.reset();
    s().may_be_moving = true;
    set_problem("turntable", e.error);  // nobody else will ask it now
    stopped();                          // no more evidence will come by itself
    if (!s().shutting_down) act(action::RetryStopLater{});
  }

  /// What cannot be read proves nothing: no motion.
  void operator()(const event::PanelFailed& e) {
    s().panel_known = false;
    s().panel_problem = e.error;
    if (s().machine != MachineState::error) fault(e.error.message + ".", "panel");
  }

  void operator()(const event::Ordered& e) { take_order(*this, e); }
  void operator()(const event::JobAsked& e) { ask_job(*this, e); }
  void operator()(const event::JobKnown& e) { job_known(*this, e.info); }
  void operator()(const event::JobRemoved& e) { job_removed(*this, e.job); }
  void operator()(const event::JobBegun& e) { job_begun(*this, e); }
  void operator()(const event::JobNotBegun& e) { job_not_begun(*this, e); }
  void operator()(const event::JobUnreadable& e) { job_unreadable(*this, e); }
  void operator()(const event::ViewTaken& e) { view_taken(*this, e); }
  void operator()(const event::ViewStored& e) { view_stored(*this, e); }
  void operator()(const event::ClosureTaken& e) { closure_taken(*this, e); }
  void operator()(const event::ClosureJudged& e) { closure_judged(*this, e); }
  void operator()(const event::PoseStored& e) { pose_stored(*this, e); }
  void operator()(const event::FlipTimedOut& e) { flip_timed_out(*this, e); }

  void operator()(const event::StoreFailed& e) { store_failed(*this, e); }
  void operator()(const event::DiskSeen& e) { disk_seen(*this, e); }

  void operator()(const event::ReconstructionFailed& e) {
    count_result(*this, e.job, false);
    if (has(e.job)) model_given_up(*this, e.error);
  }

  void operator()(const event::ModelReady& e) { count_result(*this, e.job, !e.beyond_limits); }

  /// A latched fault is not to be got rid of by a reload.
  void operator()(const event::ReloadAsked& e) {
    constexpr const char* kStays = "The configuration is not read now";
    if (s().shutting_down) return refuse(ErrorCode::busy, "{}: the daemon is ending or reloading.", kStays);
    if (s().machine == MachineState::error) {
      return refuse(ErrorCode::refused, "{}: see to the fault and press Reset, or restart the daemon.", kStays);
    }
    const bool idle = s().machine == MachineState::halted || s().machine == MachineState::ready;
    if (!idle || s().activity != Activity::none) {
      return refuse(ErrorCode::busy, "{}: the station is {} ({}). Try again when it stands idle.", kStays,
                    to_string(s().machine), to_string(s().activity));
    }
    if (!disk_answers()) return;
    if (!e.still_doing.empty()) return refuse(ErrorCode::busy, "{}: {}. Try again later.", kStays, e.still_doing);
    s().shutting_down = s().reloading = true;
    s().machine = MachineState::halted;
    s().cause = "The configuration is read again.";
    stop_rig();
  }

  void operator()(const event::Shutdown&) {
    s().reloading = false;
    if (s().shutting_down) return;
    s().shutting_down = true;
    name_fault();
    s().maintenance.reset();
    close_job(JobState::interrupted, {ErrorCode::stopped, "the daemon was shut down during the scan"});
    if (s().machine != MachineState::error) {
      s().machine = MachineState::halted;
      s().cause = "The daemon is shutting down.";
    }
    stop_rig();
  }

  /// Whatever the folder said while it was on its way to the rig, the job does not wait for the rig any more.
  void operator()(const event::JobClosed& e) { job_removed(*this, e.job); }

  // These concern the list of jobs or whoever asked.
  void operator()(const event::StageProgress&) {}
  void operator()(const event::Answered&) {}

 private:
  void stopped() {
    if (s().activity != Activity::stopping) return;
    s().activity = Activity::none;
    s().finished = s().shutting_down;
  }

  void set_problem(const std::string& name, const Error& error) {
    for (auto& device : s().devices) {
      if (device.name == name) {
        device.problem = error;
        return;
      }
    }
    s().devices.push_back({name, error});
  }

  void start(const std::string& fresh_job_id) {
    const bool flipped = s().activity == Activity::waiting_for_flip;
    if (s().maintenance)
      return refuse(ErrorCode::refused, "Maintenance mode is on: there are no jobs until it is off.");
    if (s().machine == MachineState::halted || s().machine == MachineState::error ||
        s().machine == MachineState::preoperational) {
      return refuse(ErrorCode::refused, "The station is {}: {} Press Reset first.", to_string(s().machine), s().cause);
    }
    const bool free = s().machine == MachineState::ready || s().activity == Activity::waiting_for_part;
    if (!free && !flipped) {
      return refuse(ErrorCode::busy, "The station is busy ({}).", to_string(s().activity));
    }
    if (!safe_to_move() || !all_there() || !disk_answers()) return;
    if (!flipped && !calibrated()) return;
    s().failures = 0;
    if (flipped) return continue_after_flip(*this, "The object was turned over.");
    begin_next_job(*this, fresh_job_id, "Start was pressed.");
  }

  void stop() {
    const Error why{ErrorCode::stopped, "Stop was pressed"};
    if (s().activity == Activity::waiting_for_flip || s().activity == Activity::waiting_for_part) {
      close_job(JobState::cancelled, why);
      return enter(MachineState::ready, "Stop was pressed.");
    }
    if (!may_move()) return refuse(ErrorCode::refused, "Nothing is moving.");
    close_job(JobState::cancelled, why);
    s().machine = MachineState::halted;
    s().home_by_guard = false;
    s().cause = "Stop was pressed.";
    stop_rig();
  }

  void reset(Origin origin) {
    if (s().machine != MachineState::halted && s().machine != MachineState::error) {
      return refuse(s().machine == MachineState::ready ? ErrorCode::refused : ErrorCode::busy,
                    "There is nothing to reset: the station is {}.", to_string(s().machine));
    }
    if (s().may_be_moving) {
      return refuse(ErrorCode::busy, "The table may be moving, its drive does not answer: see to power and cable.");
    }
    if (s().activity == Activity::stopping || s().unnamed) {
      return refuse(ErrorCode::busy, "The table has not been seen standing yet: wait a moment.");
    }
    if (!safe_to_move()) return;
    if (origin == Origin::panel) s().latched = false;
    begin_homing("Reset was pressed.");
  }
};

}  // namespace

Step next(const StationState& state, const Event& event, const StationRules& rules) {
  Transition transition(state, rules);
  std::visit(transition, event);
  return std::move(transition).take();
}

}  // namespace scanrig
