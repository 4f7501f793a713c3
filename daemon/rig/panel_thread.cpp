#include "daemon/rig/panel_thread.h"

#include <utility>

#include "daemon/runtime/actor.h"
#include "drivers/panel/debounce.h"

namespace scanrig {
namespace {

/// Longest wait of a lamp for a quiet panel: while the station works, and while it does not.
constexpr auto kLampWait = std::chrono::milliseconds(20);
constexpr auto kIdleLampWait = std::chrono::milliseconds(100);
constexpr auto kShowLimit = std::chrono::milliseconds(500);
constexpr auto kRetry = std::chrono::seconds(1);  ///< after a panel that did not respond

}  // namespace

std::vector<Event> changes(const PanelInputs& before, const PanelInputs& after) {
  std::vector<Event> events;
  const auto pressed = [&](bool was, bool is, Button button) {
    if (!was && is) events.emplace_back(event::Pressed{button, Origin::panel, {}});
  };
  if (before.estop_ok != after.estop_ok) events.emplace_back(event::EstopChanged{after.estop_ok});
  if (before.guard_closed != after.guard_closed) events.emplace_back(event::GuardChanged{after.guard_closed});
  if (before != after) events.emplace_back(event::InputsRead{after});
  pressed(before.stop, after.stop, Button::stop);
  pressed(before.reset, after.reset, Button::reset);
  pressed(before.start, after.start, Button::start);
  return events;
}

Clock::Duration panel_latency(Clock::Duration read_time) {
  return PanelDebounce::kDebounce + kIdleLampWait + read_time;
}

PanelThread::PanelThread(Panel& panel, Clock& clock, PanelThreadOptions options, std::function<void(Event)> post_event,
                         std::function<void()> on_estop)
    : panel_(panel, clock, options.hang_margin, options.read_time),
      clock_(clock),
      post_event_(std::move(post_event)),
      on_estop_(std::move(on_estop)),
      thread_(start_actor(clock, [this] { run(); })) {}

PanelThread::~PanelThread() {
  {
    const std::lock_guard guard(mutex_);
    stop_ = true;
  }
  clock_.notify_all(changed_);
  thread_.join();
}

void PanelThread::show(const PanelOutputs& outputs) {
  const std::lock_guard guard(mutex_);
  wanted_ = outputs;
}

void PanelThread::run() {
  while (true) {
    auto done = show_wanted();
    if (done) done = read_inputs();
    if (!done) {
      known_.reset();  // a returning panel reports all inputs as new
      post_event_(event::PanelFailed{done.error()});
    }
    std::unique_lock lock(mutex_);
    if (!done) clock_.wait_until(lock, changed_, clock_.now() + kRetry, [this] { return stop_; });
    if (stop_) break;
  }
  std::ignore = show_wanted();  // the last lamps of the station; a panel that fails here was reported before
}

Result<void> PanelThread::show_wanted() {
  PanelOutputs wanted;
  {
    const std::lock_guard guard(mutex_);
    wanted = wanted_;
  }
  if (shown_ == wanted) return {};
  shown_.reset();
  if (auto shown = panel_.show(wanted, Deadline::after(clock_, kShowLimit)); !shown) return shown;
  shown_ = wanted;
  return {};
}

Result<void> PanelThread::read_inputs() {
  // A panel whose first state is unread differs from nothing: compare with a quiet panel.
  const auto wait = shown_ && !shown_->busy ? kIdleLampWait : kLampWait;
  const auto inputs = panel_.wait_change(known_.value_or(PanelInputs{}),
                                         known_ ? Deadline::after(clock_, wait) : Deadline{clock_.now()});
  if (!inputs) return pass_on(inputs);
  if (!inputs->estop_ok && (!known_ || known_->estop_ok)) on_estop_();
  if (!known_) {
    post_event_(event::InputsRead{*inputs});
    post_event_(event::PanelFound{inputs->estop_ok, inputs->guard_closed});
  } else {
    for (auto& event : changes(*known_, *inputs)) post_event_(std::move(event));
  }
  known_ = *inputs;
  return {};
}

}  // namespace scanrig
