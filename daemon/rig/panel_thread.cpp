#include "daemon/rig/panel_thread.h"

#include <fmt/format.h>

#include <utility>

#include "daemon/runtime/actor_thread.h"

namespace scanrig {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(50);  ///< longest wait of a lamp for a quiet panel
constexpr auto kShowLimit = std::chrono::milliseconds(500);
constexpr auto kHangs = std::chrono::seconds(3);  ///< far beyond kPoll and kShowLimit
constexpr auto kRetry = std::chrono::seconds(1);  ///< after a panel that did not answer

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

PanelThread::PanelThread(Panel& panel, Clock& clock, std::function<void(Event)> post_event,
                         std::function<void()> on_estop)
    : panel_(panel),
      clock_(clock),
      post_event_(std::move(post_event)),
      on_estop_(std::move(on_estop)),
      busy_timer_(clock),
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
    const auto done = look();
    if (!done) {
      known_.reset();  // what a panel says that comes back is news
      post_event_(event::PanelFailed{done.error()});
    }
    std::unique_lock lock(mutex_);
    const auto pause = done ? clock_.now() : clock_.now() + kRetry;
    if (clock_.wait_until(lock, changed_, pause, [this] { return stop_; })) break;
  }
  std::ignore = show_wanted();  // the last word of the station; a panel that fails here was reported before
}

/// A panel that had hung is one that failed, whatever it says in the end.
Result<void> PanelThread::look() {
  busy_timer_.begins();
  auto done = show_wanted();
  if (done) done = read_inputs();
  const auto hung = hangs();
  busy_timer_.ends();
  if (done && hung) return tl::unexpected(*hung);
  return done;
}

std::optional<Error> PanelThread::hangs() const {
  const auto waited = busy_timer_.lasts();
  if (waited < kHangs) return std::nullopt;
  return Error{ErrorCode::timeout, fmt::format("panel: no response for {:.0f} s, e-stop state unknown; check its cable",
                                               std::chrono::duration<double>(waited).count())};
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
  // A panel that does not know its first state differs from nothing: ask with what a quiet panel says.
  const auto inputs = panel_.wait_change(known_.value_or(PanelInputs{}),
                                         known_ ? Deadline::after(clock_, kPoll) : Deadline{clock_.now()});
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
