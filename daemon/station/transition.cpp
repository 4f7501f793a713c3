#include "daemon/station/transition.h"

#include "daemon/station/machine.h"

namespace scanrig {
namespace {

constexpr int kMostUnstored = 2;  ///< views in memory only; a power cut costs no more

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

  void operator()(const event::InputsSeen& e) { s().inputs = e.inputs; }

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
  }

  void operator()(const event::WarningOver&) {
    if (s().activity != Activity::warning) return;
    if (s().maintenance) return move_in_maintenance(*this);
    if (s().machine == MachineState::initialized) {
      s().activity = Activity::homing;
      act(action::Home{});
    } else {
      s().activity = Activity::scanning;
      take_next_view();
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
    const bool quiet = s().activity == Activity::none && !s().may_be_moving && !s().shutting_down;
    if (quiet) {
      act(action::CheckDevices{});
    } else {
      act(action::CheckLater{});
    }
  }

  void operator()(const event::DevicesSeen& e) {
    s().devices = e.devices;
    act(action::CheckLater{});
  }

  void operator()(const event::ViewTaken& e) {
    if (s().activity != Activity::scanning) return;  // a view that came after Stop is not kept
    ++s().job->taken;
    act(action::StoreView{e.view});
    if (s().job->taken == rules().views) s().activity = Activity::storing;
    take_next_view();
  }

  /// A projector that cannot be reached is an absent device; it does not make the table move.
  void operator()(const event::Stopped& e) {
    s().may_be_moving = false;
    if (e.light) set_problem("projector", *e.light);
    stopped();
    if (!s().shutting_down) act(action::CheckDevices{});  // what is absent is shown before somebody presses Start
    home_if_guarded();
  }

  void operator()(const event::RigFailed& e) {
    if (s().activity == Activity::stopping || s().machine == MachineState::error) return;  // cut short by the stop
    fault_unnamed(e.error);
  }

  /// The first cause stays: an e-stop is an e-stop, whatever a drive without power answers.
  void operator()(const event::StopFailed& e) {
    if (s().machine != MachineState::error) s().cause = fmt::format("The table may be moving: {}.", e.error.message);
    s().machine = MachineState::error;
    s().latched = true;
    s().home_by_guard = false;
    s().maintenance.reset();
    s().may_be_moving = true;
    stopped();  // no more evidence will come by itself
    if (!s().shutting_down) act(action::RetryStopLater{});
  }

  /// What cannot be read proves nothing: no motion.
  void operator()(const event::PanelFailed& e) {
    s().panel_known = false;
    s().panel_problem = e.error;
    if (s().machine != MachineState::error) fault(e.error.message + ".");
  }

  void operator()(const event::JobCreated& e) {
    if (!has(e.job)) return;
    s().job->state = JobState::scanning;
    take_next_view();
  }

  void operator()(const event::ViewStored& e) {
    if (!has(e.id.job) || e.id.pose != s().job->pose) return;
    ++s().job->stored;
    if (s().activity == Activity::storing && s().job->stored == rules().views) {
      act(action::FinishPose{e.id.job, e.id.pose, e.id.pose + 1 == rules().poses});
    }
    take_next_view();
  }

  void operator()(const event::PoseStored& e) {
    if (!has(e.job) || s().activity != Activity::storing) return;
    if (e.pose + 1 == rules().poses) {
      s().job.reset();
      enter(MachineState::ready, fmt::format("Job {} has all its views.", e.job));
    } else if (s().job->reconstruction) {  // no use turning the object over
      close_job(JobState::failed, *s().job->reconstruction);
      enter(MachineState::ready, fmt::format("Job {} failed.", e.job));
    } else {
      s().job->state = JobState::waiting_for_flip;
      s().activity = Activity::waiting_for_flip;
      s().cause = fmt::format("Pose {} is complete.", e.pose + 1);
    }
  }

  void operator()(const event::StoreFailed& e) {
    if (!has(e.job)) return;
    close_job(JobState::failed, e.error);
    fault(e.error.message + ".");
  }

  void operator()(const event::ReconstructionFailed& e) {
    if (has(e.job)) s().job->reconstruction = e.error;
  }

  void operator()(const event::Shutdown&) {
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

  // These concern the list of jobs only.
  void operator()(const event::JobClosed&) {}
  void operator()(const event::StageProgress&) {}
  void operator()(const event::ModelReady&) {}

 private:
  bool has(const std::string& job) { return s().job && s().job->id == job; }

  void stopped() {
    if (s().activity != Activity::stopping) return;
    s().activity = Activity::none;
    s().finished = s().shutting_down;
  }

  void take_next_view() {
    if (s().activity != Activity::scanning || s().job->state != JobState::scanning) return;
    auto& job = *s().job;
    if (job.asked > job.taken || job.taken - job.stored >= kMostUnstored) return;
    act(action::TakeView{{job.id, job.pose, job.asked}, {360.0 * job.asked / rules().views}});
    ++job.asked;
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

  /// What is absent is told, and does not let a job begin.
  bool all_there() {
    for (const auto& device : s().devices) {
      if (!device.problem) continue;
      refuse(device.problem->code, "The {} is not there: {}.", device.name, device.problem->message);
      return false;
    }
    return true;
  }

  void start(const std::string& fresh_job_id) {
    const bool flipped = s().activity == Activity::waiting_for_flip;
    if (s().maintenance)
      return refuse(ErrorCode::refused, "Maintenance mode is on: there are no jobs until it is off.");
    if (s().machine == MachineState::halted || s().machine == MachineState::error ||
        s().machine == MachineState::preoperational) {
      return refuse(ErrorCode::refused, "The station is {}: {} Press Reset first.", to_string(s().machine), s().cause);
    }
    if (s().machine != MachineState::ready && !flipped) {
      return refuse(ErrorCode::busy, "The station is busy ({}).", to_string(s().activity));
    }
    if (!safe_to_move() || !all_there()) return;
    if (flipped) {
      s().job = ActiveJob{.id = s().job->id, .state = JobState::scanning, .pose = s().job->pose + 1};
      s().cause = "The object was turned over.";
      act(action::ResumeJob{s().job->id});
    } else {
      s().machine = MachineState::single_execution;
      s().cause = "Start was pressed.";
      s().job = ActiveJob{.id = fresh_job_id};
      act(action::CreateJob{fresh_job_id});
    }
    warn();
  }

  void stop() {
    const Error why{ErrorCode::stopped, "Stop was pressed"};
    if (s().activity == Activity::waiting_for_flip) {
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
