#include "daemon/station/control_loop.h"

#include <algorithm>
#include <utility>

#include "daemon/station/lamps.h"
#include "daemon/station/words.h"

namespace scanrig {

ControlLoop::ControlLoop(Clock& clock, ControlLoopOptions options, JobTable known_jobs)
    : clock_(clock), options_(options), inbox_(clock), jobs_(std::move(known_jobs)) {
  publish();
}

Result<void> ControlLoop::run(const StationPorts& ports) {
  ports.show(lamps(state_, jobs_));
  while (!state_.finished) {
    auto message = inbox_.take(std::min(warning_over_, give_up_));
    if (message) {
      handle(std::move(*message), ports);
    } else if (clock_.now() >= give_up_) {
      break;
    } else if (clock_.now() >= warning_over_) {
      warning_over_ = Clock::TimePoint::max();
      handle({event::WarningOver{}, {}}, ports);
    }
  }
  inbox_.close();
  if (!state_.finished || state_.may_be_moving) {
    return fail(ErrorCode::timeout, "the rig was not seen stopped before the daemon ended: the table may be moving");
  }
  return {};
}

void ControlLoop::handle(Message message, const StationPorts& ports) {
  if (auto* pressed = std::get_if<event::Pressed>(&message.event)) {
    if (pressed->button == Button::start) pressed->fresh_job_id = ports.fresh_job_id();
  }
  if (std::holds_alternative<event::Shutdown>(message.event) && !state_.shutting_down) {
    give_up_ = clock_.now() + options_.shutdown_limit;
  }
  auto step = next(state_, message.event, options_.rules);
  state_ = std::move(step.state);
  update(jobs_, message.event, options_.rules.poses, options_.rules.views);
  for (const auto& action : step.actions) {
    if (std::holds_alternative<action::Warn>(action)) {
      warning_over_ = clock_.now() + options_.warning;
    } else {
      ports.perform(action);
    }
  }
  publish();
  ports.show(lamps(state_, jobs_));
  if (!message.reply) return;
  if (step.refused) {
    message.reply(tl::unexpected(*step.refused));
  } else {
    message.reply(state_.job ? state_.job->id : std::string());
  }
}

void ControlLoop::publish() {
  auto words = describe(state_, options_.rules);
  published_.set(std::make_shared<const Snapshot>(Snapshot{
      .revision = ++revision_,
      .machine = state_.machine,
      .activity = state_.activity,
      .cause = state_.cause,
      .sentence = std::move(words.sentence),
      .next_action = std::move(words.next_action),
      .job = state_.job ? state_.job->id : std::string(),
      .jobs = jobs_,
  }));
}

}  // namespace scanrig
