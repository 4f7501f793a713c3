#include "daemon/station/control_loop.h"

#include <algorithm>
#include <utility>

#include "core/overloaded.h"
#include "daemon/station/operator_message.h"

namespace scanrig {
namespace {

/// Time between two checks of the calls under way: with DeviceWatch::kMargin a hang is named within a second.
constexpr auto kLook = std::chrono::milliseconds(250);
constexpr auto kBlink = std::chrono::milliseconds(500);
constexpr auto kLampTest = std::chrono::seconds(3);
/// The active job, or the one that the request has just ended.
std::string concerned_job(const StationState& state, const Step& step) {
  for (const auto& action : step.actions) {
    if (const auto* closed = std::get_if<action::CloseJob>(&action)) return closed->job;
  }
  return state.job ? state.job->id : std::string();
}

std::optional<AwaitedPlacement> awaited(const StationState& state) {
  const auto placement = awaited_placement(state);
  if (!placement) return std::nullopt;
  return AwaitedPlacement{state.job ? state.job->id : state.queue.front()->id, *placement, state.table_deg};
}

std::string_view name_of(event::MaintenanceRequested::What what) {
  using What = event::MaintenanceRequested::What;
  switch (what) {
    case What::on: return "maintenance on";
    case What::off: return "maintenance off";
    case What::home: return "home";
    case What::jog: return "jog";
    case What::pulse: return "flash";
    case What::lamp_test: break;
  }
  return "lamp test";
}

/// The order to the rig that this event is.
std::optional<LastOrder> order_in(const Event& event) {
  const auto now = std::chrono::system_clock::now();
  if (const auto* pressed = std::get_if<event::Pressed>(&event)) {
    const auto* what = pressed->button == Button::start ? "start" : pressed->button == Button::stop ? "stop" : "reset";
    return LastOrder{what, pressed->origin == Origin::panel ? "panel" : pressed->requester, now};
  }
  const auto* asked = std::get_if<event::MaintenanceRequested>(&event);
  if (asked == nullptr) return std::nullopt;
  return LastOrder{std::string(name_of(asked->what)), asked->requester, now};
}

constexpr PanelOutputs kAllOn{true, true, true, true, true, true, true, true};

}  // namespace

ControlLoop::ControlLoop(Clock& clock, ControlLoopOptions options, JobTable known_jobs)
    : clock_(clock), options_(std::move(options)), inbox_(clock), jobs_(std::move(known_jobs)) {
  for (const auto& [id, job] : jobs_) {
    state_ = next(state_, event::JobUpdated{job}, options_.rules).state;
  }
  state_.warm_up_left = options_.warm_up;
  if (options_.latch) {
    state_.latch = options_.latch;
    state_.cause = options_.latch->cause;
    state_.fault_device = options_.latch->device;
  }
  if (options_.rules.lent) {
    state_.machine = MachineState::maintenance;
    state_.maintenance.emplace();
    state_.cause = "The devices are lent to setup.";
  }
  publish({});
}

Result<Ended> ControlLoop::run(const StationPorts& ports) {
  wake_later(event::CheckDue{}, options_.check_period);
  show(ports);
  while (!state_.finished) {
    ports.alive();
    look_at_the_disk(ports);
    look_at_the_panel(ports);
    look_at_the_rig(ports);
    if (lost_) break;
    auto next_later = std::ranges::min_element(later_, {}, [](const auto& one) { return one.second.at; });
    const auto later = next_later == later_.end() ? Clock::TimePoint::max() : next_later->second.at;
    auto message = inbox_.take(std::min({later, next_blink_, give_up_, clock_.now() + kLook}));
    if (message) {
      handle(std::move(*message), ports);
    } else if (clock_.now() >= give_up_) {
      break;
    } else if (clock_.now() >= next_blink_) {
      blink(ports);
    } else if (clock_.now() >= later) {
      auto due = later_.extract(next_later);
      handle({std::move(due.mapped().event), {}}, ports);
    }
  }
  inbox_.close();
  if (lost_) return tl::unexpected(*lost_);
  if (!state_.finished || state_.may_be_moving) {
    return fail(ErrorCode::timeout, "the rig was not seen stopped before the service ended: the table may be moving");
  }
  return state_.reloading ? Ended::reload : Ended::shut_down;
}

void ControlLoop::handle(Message message, const StationPorts& ports) {
  prepare(message, ports);
  auto step = next(state_, message.event, options_.rules);
  if (step.state.shutting_down && !state_.shutting_down) give_up_ = clock_.now() + options_.shutdown_limit;
  const bool latch_changed = step.state.latch != state_.latch;
  state_ = std::move(step.state);
  counter_.see(message.event, clock_.now());
  if (auto order = step.refused ? std::nullopt : order_in(message.event)) last_order_ = std::move(order);
  if (const auto ended = update(jobs_, message.event)) counter_.see(*ended);
  for (const auto& action : step.actions) carry_out(action, ports);
  // The rig is being stopped by now. Neither the lamp nor anything else reports a latch before it is stored.
  if (latch_changed) ports.store_latch(state_.latch);
  show(ports);
  publish(ports);
  const auto* pressed = std::get_if<event::Pressed>(&message.event);
  if (step.refused && pressed && pressed->origin == Origin::panel) ports.refused_at_panel(*pressed, *step.refused);
  answer(message, step);
  if (std::holds_alternative<event::CheckDue>(message.event)) look_at_the_time(ports);
}

/// Adds to the event what only this loop has.
void ControlLoop::prepare(Message& message, const StationPorts& ports) {
  auto& event = message.event;
  if (auto* pressed = std::get_if<event::Pressed>(&event)) {
    if (pressed->button == Button::start) pressed->new_job_id = ports.new_job_id();
  } else if (auto* ordered = std::get_if<event::JobsOrdered>(&event)) {
    ordered->request_id = ++last_request_id_;
    for (int i = 0; i < std::clamp(ordered->order.repeat, 0, 100); ++i) {
      ordered->new_ids.push_back(ports.new_job_id());
    }
  } else if (auto* asked = std::get_if<event::JobRequested>(&event)) {
    asked->request_id = ++last_request_id_;
  } else if (auto* reload = std::get_if<event::ReloadRequested>(&event)) {
    reload->still_doing = still_doing();
  }
}

/// Actions for jobs other than the active one.
std::string ControlLoop::still_doing() const {
  for (const auto& [id, job] : jobs_) {
    if (job->state == JobState::reconstructing) return fmt::format("job {} is being reconstructed", id);
  }
  return waiting_.empty() ? "" : "something that was asked of a job is being done";
}

/// Sends the reply to a requester when its longer work is done.
void ControlLoop::answer(Message& message, const Step& step) {
  if (const auto* answered = std::get_if<event::RequestDone>(&message.event)) {
    if (auto waiting = waiting_.extract(answered->request_id)) waiting.mapped()(answered->result);
  }
  if (!message.reply) return;
  const bool takes_a_while = std::holds_alternative<event::JobsOrdered>(message.event) ||
                             std::holds_alternative<event::JobRequested>(message.event);
  if (step.refused) {
    message.reply(tl::unexpected(*step.refused));
  } else if (takes_a_while) {
    waiting_[last_request_id_] = std::move(message.reply);
  } else {
    message.reply(concerned_job(state_, step));
  }
}

/// Watches quiet hours, which follow the wall clock, and the projector's warm-up.
void ControlLoop::look_at_the_time(const StationPorts& ports) {
  const bool quiet = ports.quiet_hours();
  if (quiet != state_.quiet) handle({event::QuietHours{quiet}, {}}, ports);
  const auto left = warm_up_left();
  if (left != state_.warm_up_left) handle({event::WarmingUp{left}, {}}, ports);
}

/// Reports when the disk stops responding, and when it responds again.
void ControlLoop::look_at_the_disk(const StationPorts& ports) {
  auto problem = ports.disk_problem();
  if (problem.has_value() != state_.disk_problem.has_value())
    handle({event::DiskChecked{std::move(problem)}, {}}, ports);
}

/// Its owner reports its return.
void ControlLoop::look_at_the_panel(const StationPorts& ports) {
  const auto call = ports.panel_hangs();
  if (!call) return;
  if (!state_.panel_problem) handle({event::PanelFailed{hung_error(*call)}, {}}, ports);
  if (is_lost(*call)) lost_ = hung_error(*call);
}

/// A hang may also keep a stop from returning, by its own path or by the path past it.
void ControlLoop::look_at_the_rig(const StationPorts& ports) {
  auto call = ports.rig_hangs();
  const auto device_of = [](const std::optional<HungCall>& one) { return one ? one->device : std::string(); };
  if (device_of(call) != device_of(state_.hung)) handle({event::HungCallChanged{call}, {}}, ports);
  if (call && is_lost(*call)) lost_ = hung_error(*call);
}

/// Where no other process can stop the drive while this one has it, this one ends at once.
bool ControlLoop::is_lost(const HungCall& call) const {
  const bool unreached = call.device == "turntable" && state_.may_be_moving && state_.activity == Activity::none;
  return unreached || call.late >= options_.hang_limit;
}

/// A projector that was away may have been without power: its warm-up restarts.
std::chrono::seconds ControlLoop::warm_up_left() {
  const auto now = clock_.now();
  const auto projector = std::ranges::find(state_.devices, "projector", &DeviceHealth::name);
  const bool there = projector != state_.devices.end() && !projector->problem;
  projector_since_ = there ? projector_since_.value_or(now) : std::optional<Clock::TimePoint>();
  const auto left = projector_since_.value_or(now) + options_.warm_up - now;
  return std::max(std::chrono::seconds(0), std::chrono::ceil<std::chrono::seconds>(left));
}

void ControlLoop::carry_out(const Action& action, const StationPorts& ports) {
  std::visit(
      Overloaded{[&](const action::Warn&) { wake_later(event::WarningOver{}, options_.warning); },
                 [&](const action::WaitForEstop&) { wake_later(event::EstopWindowOver{}, options_.estop_window); },
                 [&](const action::RetryStopLater&) { wake_later(event::StopRetryDue{}, options_.stop_retry); },
                 [&](const action::EndConsentLater& wait) { wake_later(event::ConsentTimeout{}, wait.after); },
                 [&](const action::WaitForFlip& flip) { wake_later(event::FlipTimedOut{flip.job}, flip.limit); },
                 [&](const action::CheckLater&) { wake_later(event::CheckDue{}, options_.check_period); },
                 [&](const action::TestLamps&) { lamps_tested_ = clock_.now() + kLampTest; },
                 [&](const action::CloseJob& task) {
                   if (const auto ended = close(jobs_, task)) counter_.see(*ended);
                   ports.perform(task);
                 },
                 [&](const auto& other) { ports.perform(other); }},
      action);
}

void ControlLoop::wake_later(Event event, Clock::Duration after) {
  const auto kind = event.index();
  later_.insert_or_assign(kind, Later{clock_.now() + after, std::move(event)});
}

void ControlLoop::blink(const StationPorts& ports) {
  blink_ = !blink_;
  show(ports);
}

/// Blinking lamps, and a lamp test, need an update soon.
void ControlLoop::show(const StationPorts& ports) {
  const bool testing = clock_.now() < lamps_tested_;
  shown_ = testing ? kAllOn : lamps(state_, jobs_, blink_);
  next_blink_ = testing || state_.maintenance ? clock_.now() + kBlink : Clock::TimePoint::max();
  ports.show(shown_);
}

void ControlLoop::publish(const StationPorts& ports) {
  auto words = describe(state_, options_.rules);
  auto devices = state_.devices;
  const auto* const calibration = calibration_problem(state_);
  devices.push_back({"panel", state_.panel_problem});
  if (state_.disk_problem) devices.push_back({"disk", state_.disk_problem});
  std::vector<std::string> queue;
  for (const auto& job : state_.queue) queue.push_back(job->id);
  auto snapshot = std::make_shared<const Snapshot>(Snapshot{
      .revision = ++revision_,
      .machine = state_.machine,
      .activity = state_.activity,
      .cause = state_.cause,
      .sentence = std::move(words.sentence),
      .next_action = std::move(words.next_action),
      .headline = headline(state_),
      .actions = remote_actions(state_, options_.rules),
      .may_be_moving = state_.may_be_moving,
      .fault_device = state_.machine == MachineState::error ? state_.fault_device : std::string(),
      .inputs = state_.inputs,
      .outputs = shown_,
      .devices = std::move(devices),
      .calibration_problem = calibration ? std::optional(*calibration) : std::nullopt,
      .calibration_reminder = state_.calibration.reminder,
      .awaited_placement = awaited(state_),
      .last_order = last_order_,
      .job = state_.job ? state_.job->id : std::string(),
      .not_started = state_.not_started,
      .queue = std::move(queue),
      .jobs = jobs_,
      .counters = counter_.counters(),
  });
  published_.set(snapshot);
  ports.published(snapshot);
}

}  // namespace scanrig
