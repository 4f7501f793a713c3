#include "daemon/station/transition.h"

#include "daemon/station/step_builder.h"

namespace scanrig {
namespace {

event::RigFailed alarm_failure(const std::string& alarm) {
  return {{ErrorCode::device_alarm, fmt::format("The drive reports an alarm: {}", alarm)}, "turntable"};
}

class Transition : public StepBuilder {
 public:
  using StepBuilder::StepBuilder;

  void operator()(const event::PanelFound& e) {
    s().panel_known = true;
    s().panel_problem.reset();
    s().estop_ok = e.estop_ok;
    s().guard_closed = e.guard_closed;
    if (s().machine == MachineState::preoperational) {
      s().machine = s().latch ? MachineState::error : MachineState::halted;
      stop_rig();
    }
    if (!e.estop_ok && !s().latch) fault("The e-stop is pressed.");
  }

  void operator()(const event::InputsRead& e) { inputs_read(*this, e.inputs); }

  void operator()(const event::Pressed& e) {
    if (e.button == Button::stop) return stop();
    if (s().shutting_down) return refuse(ErrorCode::refused, "The service is shutting down.");
    if (rules().lent) return refuse_lent();
    const bool remote = e.origin == Origin::remote;
    switch (e.button) {
      case Button::start:
        if (remote && !remote_may_move("start")) return;
        if (!e.offer.empty() && e.offer != start_offer(s())) {
          return refuse(ErrorCode::refused,
                        "The rig has changed since: check what it asks for, then press Start again.");
        }
        return start(e.new_job_id);
      case Button::stop: return;  // above
      case Button::reset:
        if (s().maintenance) return reset_in_maintenance(*this, e.origin);
        if (remote && !remote_may_move("reset")) return;
        return reset(e.origin);
    }
  }

  void operator()(const event::EstopChanged& e) {
    s().estop_ok = e.ok;
    if (!e.ok) return estop("The e-stop was pressed.");
    auto_home_if_allowed();
  }

  void operator()(const event::GuardChanged& e) {
    s().guard_closed = e.closed;
    if (!e.closed) guard_opened_in_maintenance(*this);
    const bool is_hazard = may_move() || s().activity == Activity::pulsing;
    if (!e.closed && is_hazard) return fault(fmt::format("The guard was opened {}.", meanwhile()));
    auto_home_if_allowed();
    handle_part_signals(*this);
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
    s().has_no_alarm = true;
    s().table_deg = 0.0;
    if (s().maintenance) {
      s().maintenance->homed = true;
      moved_in_maintenance(*this);
    }
    enter(s().maintenance ? MachineState::maintenance : MachineState::ready, "The table is homed.");
  }

  void operator()(const event::Jogged& e) {
    if (s().activity != Activity::jogging) return;
    s().maintenance->jog.reset();
    s().table_deg = e.measured.value;
    moved_in_maintenance(*this);
    enter(MachineState::maintenance, fmt::format("The table is at {:.3f} deg.", e.measured.value));
  }

  void operator()(const event::Pulsed&) {
    if (s().activity == Activity::pulsing) enter(MachineState::maintenance, "The projector has flashed.");
  }

  void operator()(const event::MaintenanceRequested& e) { ask_maintenance(*this, e); }
  void operator()(const event::ConsentTimeout&) { consent_timed_out(*this); }

  void operator()(const event::EstopWindowOver&) { classify_fault(); }

  /// While standstill is unconfirmed, stop is requested repeatedly: the first frame that gets through counts.
  void operator()(const event::StopRetryDue&) {
    if (s().may_be_moving && s().activity == Activity::none && !s().shutting_down) send_stop();
  }

  /// Requests to devices are for quiet times only.
  void operator()(const event::CheckDue&) {
    const bool standing = s().activity == Activity::none || s().activity == Activity::waiting_for_flip ||
                          s().activity == Activity::waiting_for_part;
    if (standing && !s().may_be_moving && !s().shutting_down) {
      check();
    } else {
      act(action::CheckLater{});
    }
  }

  void operator()(const event::DevicesChecked& e) {
    s().devices = e.devices;
    act(action::CheckLater{});
    if (e.drive) check_drive(*e.drive);
    handle_part_signals(*this);
  }

  /// The call that finally returns may have been a stop that has no evidence yet.
  void operator()(const event::HungCallChanged& e) {
    const auto before = std::exchange(s().hung, e.call);
    if (s().shutting_down && !e.call) return;
    if (!e.call) return before ? stop_rig() : void();
    const auto error = hung_error(*e.call);
    if (s().machine != MachineState::error) {
      fault(error.message + ".", e.call->device);
    } else {
      stop_rig();  // the one before may be waiting behind this call
    }
    set_problem(e.call->device, error);
  }

  void operator()(const event::CalibrationChecked& e) {
    s().calibration = e;
    handle_part_signals(*this);
  }

  void operator()(const event::QuietHours& e) {
    s().quiet = e.quiet;
    handle_part_signals(*this);
  }

  void operator()(const event::WarmingUp& e) {
    s().warm_up_left = e.left;
    handle_part_signals(*this);
  }

  /// A projector that cannot be reached is an absent device; it does not make the table move.
  void operator()(const event::Stopped& e) {
    s().may_be_moving = false;
    if (e.light) set_problem("projector", *e.light);
    stopped();
    if (!s().shutting_down) check();  // problems are shown before the operator presses Start
    auto_home_if_allowed();
  }

  void operator()(const event::RigFailed& e) {
    if (s().activity == Activity::stopping || s().machine == MachineState::error) return;  // cut short by the stop
    fault_unclassified(e);
  }

  /// The first cause stays: an e-stop is an e-stop, whatever a drive without power returns.
  void operator()(const event::StopFailed& e) {
    if (s().machine != MachineState::error) {
      s().cause = fmt::format("The table may be moving: {}.", e.error.message);
      s().fault_device = "turntable";
    }
    s().machine = MachineState::error;
    if (!s().latch) s().latch = Latch{s().cause, "turntable"};
    s().auto_home_allowed = false;
    s().maintenance.reset();
    s().may_be_moving = true;
    set_problem("turntable", e.error);  // no other check of it will follow
    stopped();                          // no further evidence will come
    if (!s().shutting_down) act(action::RetryStopLater{});
  }

  /// An unreadable panel proves nothing: no motion.
  void operator()(const event::PanelFailed& e) {
    s().panel_known = false;
    s().panel_problem = e.error;
    if (rules().lent) return;  // setup has it
    if (s().machine != MachineState::error) fault(e.error.message + ".", "panel");
  }

  void operator()(const event::JobsOrdered& e) { take_order(*this, e); }
  void operator()(const event::JobRequested& e) { ask_job(*this, e); }
  void operator()(const event::JobUpdated& e) { job_updated(*this, e.info); }
  void operator()(const event::JobRemoved& e) { job_removed(*this, e.job); }
  void operator()(const event::JobStarted& e) { job_started(*this, e); }
  void operator()(const event::JobNotStarted& e) { job_not_started(*this, e); }
  void operator()(const event::JobUnreadable& e) { job_unreadable(*this, e); }
  void operator()(const event::ViewTaken& e) { view_taken(*this, e); }
  void operator()(const event::ViewStored& e) { view_stored(*this, e); }
  void operator()(const event::CheckViewTaken& e) { check_view_taken(*this, e); }
  void operator()(const event::MovementChecked& e) { movement_checked(*this, e); }
  void operator()(const event::PoseStored& e) { pose_stored(*this, e); }
  void operator()(const event::FlipTimedOut& e) { flip_timed_out(*this, e); }
  void operator()(const event::ImagesChecked& e) { images_checked(*this, e); }
  void operator()(const event::PlacementChecked& e) { placement_checked(*this, e); }
  void operator()(const event::PlacementDropped& e) { placement_dropped(*this, e); }
  void operator()(const event::Turned&) { turned(*this); }

  void operator()(const event::StoreFailed& e) { store_failed(*this, e); }
  void operator()(const event::DiskChecked& e) { disk_checked(*this, e); }

  void operator()(const event::ReconstructionFailed& e) {
    count_result(*this, e.job, false);
    if (is_active(e.job)) model_given_up(*this, e.error);
  }

  void operator()(const event::ModelReady& e) {
    count_result(*this, e.job, !e.limit_violation);
    if (!e.calibration || !rules().accepts_calibrations || s().shutting_down) return;
    act(action::RunJobRequest{{.what = event::JobRequested::What::accept, .job = e.job}});
  }

  void operator()(const event::ReloadRequested& e) { ask_restart(*this, e); }

  void operator()(const event::Shutdown&) {
    s().reloading = false;
    if (s().shutting_down) return;
    s().shutting_down = true;
    classify_fault();
    s().maintenance.reset();
    close_job(JobState::interrupted, {ErrorCode::stopped, "the service was shut down during the scan"});
    if (s().machine != MachineState::error) {
      s().machine = MachineState::halted;
      s().cause = "The service is shutting down.";
    }
    stop_rig();
  }

  /// Whatever state the folder had on its way to the rig, the job does not wait for the rig any more.
  void operator()(const event::JobClosed& e) { job_removed(*this, e.job); }

  // These concern the list of jobs or the requester.
  void operator()(const event::StageProgress&) {}
  void operator()(const event::LiveMeshes&) {}
  void operator()(const event::RestsSuggested&) {}
  void operator()(const event::RequestDone&) {}

 private:
  /// Requested motion has ended before the devices are checked. An alarm from before the daemon's start, or with a
  /// latched fault, is left to Reset. An e-stop takes the drive's power away and must keep its name.
  void check_drive(const event::DriveReport& drive) {
    if (s().shutting_down) return;
    if (drive.is_moving) {
      if (s().machine != MachineState::error) return fault("The table moved without a request.", "turntable");
      if (s().activity == Activity::none) stop_rig();
      return;
    }
    const bool is_new = std::exchange(s().has_no_alarm, drive.alarm.empty()) && !drive.alarm.empty();
    if (is_new && !s().latch) fault_unclassified(alarm_failure(drive.alarm));
  }

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

  void start(const std::string& new_job_id) {
    const bool flipped = s().activity == Activity::waiting_for_flip;
    if (s().maintenance) return refuse(ErrorCode::refused, "Maintenance mode is on. Switch it off to run jobs.");
    if (s().machine == MachineState::halted || s().machine == MachineState::error ||
        s().machine == MachineState::preoperational) {
      return refuse(ErrorCode::refused, "The rig is {}: {} Press Reset first.", to_string(s().machine), s().cause);
    }
    const bool free = s().machine == MachineState::ready || s().activity == Activity::waiting_for_part;
    if (!free && !flipped) {
      return refuse(ErrorCode::busy, "The rig is busy ({}). Try again when idle.", to_string(s().activity));
    }
    if (!require_safe() || !require_devices() || !require_disk()) return;
    if (!flipped && !require_calibration()) return;
    s().failures = 0;
    if (flipped) {
      return continue_after_flip(
          *this, s().job->recipe.is_calibration() ? "The board is in place." : "The part was turned over.");
    }
    start_next_job(*this, new_job_id, "Start was pressed.");
  }

  /// Never refused: in every state the drive is commanded to stop and the light goes out. The job stays resumable. Home
  /// is lost only where something was moving, or about to.
  void stop() {
    const bool was_active = may_move();
    if (!s().unclassified) close_job(JobState::interrupted, {ErrorCode::stopped, "Stop was pressed"});
    s().auto_home_allowed = false;
    if (s().maintenance) {
      s().maintenance->jog.reset();
      if (was_active) s().maintenance->homed = false;
    } else if (s().machine == MachineState::ready || executing()) {
      s().machine = was_active ? MachineState::halted : MachineState::ready;
    } else if (s().machine == MachineState::initialized) {
      s().machine = MachineState::halted;
    }
    if (s().machine != MachineState::error && !s().shutting_down) s().cause = "Stop was pressed.";
    stop_rig();
  }

  bool executing() {
    return s().machine == MachineState::single_execution || s().machine == MachineState::continuous_execution;
  }

  void reset(Origin origin) {
    if (s().machine != MachineState::halted && s().machine != MachineState::error) {
      const bool is_ready = s().machine == MachineState::ready;
      return refuse(is_ready ? ErrorCode::refused : ErrorCode::busy, "Nothing to reset: the rig is {}.",
                    is_ready                                      ? "ready"
                    : s().machine == MachineState::preoperational ? "starting"
                                                                  : "working");
    }
    if (s().may_be_moving) {
      return refuse(ErrorCode::busy, "The table may be moving: check the drive's power and cable.");
    }
    if (s().hung) {
      return refuse(ErrorCode::busy, "The {} does not respond: wait, the service restarts itself.", s().hung->device);
    }
    if (s().activity == Activity::stopping || s().unclassified) {
      return refuse(ErrorCode::busy, "The table is still stopping: wait.");
    }
    if (!require_safe()) return;
    if (origin == Origin::panel) s().latch.reset();
    begin_homing("Reset was pressed.");
  }
};

}  // namespace

std::string start_offer(const StationState& state) {
  if (state.job) return fmt::format("continue-{}-{}", state.job->id, state.job->pose);
  if (state.queue.empty()) return fmt::format("begin-new-{}", state.last_started_job);
  return fmt::format("begin-{}-{}", state.queue.front()->id, state.queue.front()->complete);
}

Step next(const StationState& state, const Event& event, const StationRules& rules) {
  Transition transition(state, rules);
  std::visit(transition, event);
  return std::move(transition).take();
}

}  // namespace scanrig
