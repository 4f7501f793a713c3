#include "daemon/rig/rig_thread.h"

#include <fmt/format.h>

#include <utility>

#include "daemon/runtime/actor.h"

namespace scanrig {
namespace {

ViewExposures exposures_of(const action::TakeView& view) {
  if (view.plain_only) return ViewExposures::plain_only;
  return view.movement_check ? ViewExposures::one_pattern : ViewExposures::all;
}

}  // namespace

RigThread::RigThread(const Devices& devices, Clock& clock, const AcquisitionOptions& options, Preview& preview,
                     std::function<void(Event)> post_event, Clock::Duration hang_margin)
    : post_event_(std::move(post_event)),
      stop_limit_(options.stop_limit),
      watched_turntable_(devices.turntable, clock, hang_margin),
      projector_(devices.projector, clock, hang_margin),
      camera_(devices.camera, clock, hang_margin),
      turntable_(watched_turntable_, clock),
      devices_{turntable_, projector_, camera_, devices.panel},
      acquisition_(devices_, clock, options, [&preview](const StereoFrame& pair) { preview.keep(pair); }),
      preview_(preview),
      inbox_(clock),
      thread_(start_actor(clock, [this] { run(); })) {
  preview_.on_wanted([this] { post(Look{}); });
}

RigThread::~RigThread() {
  preview_.on_wanted(nullptr);
  interrupt();
  inbox_.close();
  thread_.join();
}

void RigThread::stop() {
  interrupt();
  post(action::StopRig{});
}

void RigThread::interrupt() noexcept {
  acquisition_.interrupt();
  devices_.turntable.request_stop();
  devices_.projector.request_off();
}

void RigThread::stop_directly() {
  acquisition_.interrupt();
  devices_.projector.request_off();
  turntable_.stop_directly(stop_limit_, [this](const Result<void>& stopped) {
    if (!stopped) return post_event_(event::StopFailed{stopped.error()});
    const auto call = hung();
    const auto why = call ? fmt::format(", {} hangs in {}", call->device, call->call) : "";
    post_event_(event::Stopped{Error{ErrorCode::timeout, fmt::format("projector: not confirmed dark{}", why)}});
  });
}

std::optional<HungCall> RigThread::hung() const {
  if (auto call = watched_turntable_.hung()) return call;
  if (auto call = projector_.hung()) return call;
  return camera_.hung();
}

void RigThread::run() {
  while (const auto asked = inbox_.take()) {
    if (std::holds_alternative<Look>(asked->what)) {
      capture_preview();
    } else {
      post_event_(perform(*asked));
    }
  }
}

void RigThread::capture_preview() {
  const auto pair = acquisition_.capture_preview();
  pair ? preview_.keep(*pair) : preview_.failed(pair.error());
}

/// `interrupts`: the count when the work was requested.
Result<void> RigThread::home_now(unsigned interrupts) {
  auto home = acquisition_.home();
  // The turntable keeps a stop that found nothing running, and ends the next move by it: that was this one.
  const bool stale = !home && home.error().code == ErrorCode::stopped && acquisition_.interrupts() == interrupts;
  return stale ? acquisition_.home() : home;
}

Event RigThread::perform(const Asked& asked) {
  const auto& command = asked.what;
  const bool harmless =
      std::holds_alternative<action::CheckDevices>(command) || std::holds_alternative<action::StopRig>(command);
  if (!harmless && acquisition_.interrupts() != asked.interrupts) {
    return event::RigFailed{{ErrorCode::stopped, "rig: stopped on request before it began"}, {}};
  }
  if (std::holds_alternative<action::Home>(command)) {
    auto home = home_now(asked.interrupts);
    if (!home) return event::RigFailed{home.error(), acquisition_.failed_device()};
    return event::Homed{};
  }
  if (const auto* view = std::get_if<action::TakeView>(&command)) {
    auto taken = acquisition_.take_view(view->id, view->angle, exposures_of(*view));
    if (!taken) return event::RigFailed{taken.error(), acquisition_.failed_device()};
    auto shared = std::make_shared<const TakenView>(std::move(*taken));
    if (view->movement_check) return event::CheckViewTaken{std::move(shared)};
    return event::ViewTaken{std::move(shared)};
  }
  if (const auto* turn = std::get_if<action::TurnTo>(&command)) {
    const auto turned = acquisition_.turn_to(turn->angle);
    if (!turned) return event::RigFailed{turned.error(), acquisition_.failed_device()};
    return event::Turned{};
  }
  if (const auto* jog = std::get_if<action::Jog>(&command)) {
    const auto measured = acquisition_.jog(*jog);
    if (!measured) return event::RigFailed{measured.error(), acquisition_.failed_device()};
    return event::Jogged{*measured};
  }
  if (std::holds_alternative<action::Pulse>(command)) {
    const auto fired = acquisition_.pulse();
    if (!fired) return event::RigFailed{fired.error(), acquisition_.failed_device()};
    return event::Pulsed{};
  }
  if (std::holds_alternative<action::CheckDevices>(command)) return acquisition_.check();
  const auto stopped = acquisition_.stop();
  if (!stopped.table) return event::StopFailed{stopped.table.error()};
  // Work from before this stop is refused above: what the turntable gets from now on is a person's new decision.
  devices_.turntable.drop_stop_request();
  return event::Stopped{stopped.light ? std::nullopt : std::optional(stopped.light.error())};
}

}  // namespace scanrig
