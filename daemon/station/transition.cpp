#include "daemon/station/transition.h"

#include <fmt/format.h>

namespace scanrig {
namespace {

constexpr int kMostUnstored = 2;  ///< views in memory only; a power cut costs no more

class Transition {
 public:
  Transition(const StationState& state, const StationRules& rules) : rules_(rules) { step_.state = state; }

  void operator()(const event::PanelFound& e) {
    s().estop_ok = e.estop_ok;
    s().guard_closed = e.guard_closed;
    if (s().machine != MachineState::preoperational) return;
    s().machine = MachineState::halted;
    stop_rig();
    if (!e.estop_ok) fault("The e-stop is pressed.");
  }

  void operator()(const event::Pressed& e) {
    if (s().shutting_down) return refuse(ErrorCode::refused, "The daemon is shutting down.");
    if (e.origin == Origin::remote && e.button != Button::stop && !rules_.remote) {
      return refuse(ErrorCode::refused, "Remote {} is switched off: press {} at the panel.", to_string(e.button),
                    e.button == Button::start ? "Start" : "Reset");
    }
    switch (e.button) {
      case Button::start: return start(e.fresh_job_id);
      case Button::stop: return stop();
      case Button::reset: return reset();
    }
  }

  void operator()(const event::EstopChanged& e) {
    s().estop_ok = e.ok;
    if (!e.ok) fault("The e-stop was pressed.");
  }

  void operator()(const event::GuardChanged& e) {
    s().guard_closed = e.closed;
    if (!e.closed && may_move()) fault("The guard was opened while the table was moving.");
  }

  void operator()(const event::WarningOver&) {
    if (s().activity != Activity::warning) return;
    if (s().machine == MachineState::initialized) {
      s().activity = Activity::homing;
      act(action::Home{});
    } else {
      s().activity = Activity::scanning;
      take_next_view();
    }
  }

  void operator()(const event::Homed&) {
    if (s().activity == Activity::homing) enter(MachineState::ready, "The table is homed.");
  }

  void operator()(const event::ViewTaken& e) {
    if (s().activity != Activity::scanning) return;  // a view that came after Stop is not kept
    ++s().job->taken;
    act(action::StoreView{e.view});
    if (s().job->taken == rules_.views) s().activity = Activity::storing;
    take_next_view();
  }

  void operator()(const event::Stopped&) {
    s().may_be_moving = false;
    stopped();
  }

  void operator()(const event::RigFailed& e) {
    if (s().activity == Activity::stopping || s().machine == MachineState::error) return;  // cut short by the stop
    fault(e.error.message + ".");
  }

  void operator()(const event::StopFailed& e) {
    s().machine = MachineState::error;
    s().cause = fmt::format("The table may be moving: {}.", e.error.message);
    s().may_be_moving = true;
    stopped();  // no more evidence will come
  }

  void operator()(const event::PanelFailed& e) {
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
    if (s().activity == Activity::storing && s().job->stored == rules_.views) {
      act(action::FinishPose{e.id.job, e.id.pose, e.id.pose + 1 == rules_.poses});
    }
    take_next_view();
  }

  void operator()(const event::PoseStored& e) {
    if (!has(e.job) || s().activity != Activity::storing) return;
    if (e.pose + 1 == rules_.poses) {
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

  Step take() && { return std::move(step_); }

 private:
  StationState& s() { return step_.state; }
  template <class SomeAction>
  void act(SomeAction action) {
    step_.actions.emplace_back(std::move(action));
  }
  bool has(const std::string& job) { return s().job && s().job->id == job; }

  template <class... Args>
  void refuse(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) {
    step_.refused = Error{code, fmt::format(text, std::forward<Args>(args)...)};
  }

  bool may_move() {
    const auto a = s().activity;
    return a == Activity::warning || a == Activity::homing || a == Activity::scanning || a == Activity::storing;
  }

  void enter(MachineState machine, std::string cause) {
    s().machine = machine;
    s().activity = Activity::none;
    s().cause = std::move(cause);
  }

  void warn() {
    s().activity = Activity::warning;
    act(action::Warn{});
  }

  void stop_rig() {
    s().activity = Activity::stopping;
    act(action::StopRig{});
  }

  void stopped() {
    if (s().activity != Activity::stopping) return;
    s().activity = Activity::none;
    s().finished = s().shutting_down;
  }

  void close_job(JobState state, Error why) {
    if (!s().job) return;
    act(action::CloseJob{s().job->id, state, std::move(why)});
    s().job.reset();
  }

  /// Latches: only Reset leaves the state.
  void fault(std::string cause) {
    close_job(JobState::interrupted, {ErrorCode::stopped, cause});
    s().machine = MachineState::error;
    s().cause = std::move(cause);
    stop_rig();
  }

  void take_next_view() {
    if (s().activity != Activity::scanning || s().job->state != JobState::scanning) return;
    auto& job = *s().job;
    if (job.asked > job.taken || job.taken - job.stored >= kMostUnstored) return;
    act(action::TakeView{{job.id, job.pose, job.asked}, {360.0 * job.asked / rules_.views}});
    ++job.asked;
  }

  bool closed_and_ok() {
    if (!s().estop_ok) refuse(ErrorCode::refused, "The e-stop is pressed: release it first.");
    if (s().estop_ok && !s().guard_closed) refuse(ErrorCode::refused, "The guard is open: close it first.");
    return !step_.refused;
  }

  void start(const std::string& fresh_job_id) {
    const bool flipped = s().activity == Activity::waiting_for_flip;
    if (s().machine == MachineState::halted || s().machine == MachineState::error ||
        s().machine == MachineState::preoperational) {
      return refuse(ErrorCode::refused, "The station is {}: {} Press Reset first.", to_string(s().machine), s().cause);
    }
    if (s().machine != MachineState::ready && !flipped) {
      return refuse(ErrorCode::busy, "The station is busy ({}).", to_string(s().activity));
    }
    if (!closed_and_ok()) return;
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
    s().cause = "Stop was pressed.";
    stop_rig();
  }

  void reset() {
    if (s().machine != MachineState::halted && s().machine != MachineState::error) {
      return refuse(s().machine == MachineState::ready ? ErrorCode::refused : ErrorCode::busy,
                    "There is nothing to reset: the station is {}.", to_string(s().machine));
    }
    if (s().activity == Activity::stopping) {
      return refuse(ErrorCode::busy, "The table has not been seen standing yet: wait a moment.");
    }
    if (!closed_and_ok()) return;
    s().machine = MachineState::initialized;
    s().cause = "Reset was pressed.";
    warn();
  }

  StationRules rules_;
  Step step_;
};

}  // namespace

Step next(const StationState& state, const Event& event, const StationRules& rules) {
  Transition transition(state, rules);
  std::visit(transition, event);
  return std::move(transition).take();
}

}  // namespace scanrig
