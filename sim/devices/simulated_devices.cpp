#include "sim/devices/simulated_devices.h"

#include "core/units.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {

Result<void> SimProjector::fire(Light light, Deadline deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  b.dark_requested = false;
  b.edge(light);
  const auto over = b.clock.now() + b.exposure_time();
  const bool cut = b.clock.wait_until(lock, b.changed, std::min(over, deadline.at), [&b] { return b.dark_requested; });
  if (cut || deadline.at < over) b.in_flight.reset();  // half an exposure does not count
  if (cut) return fail(ErrorCode::io, "projector: went dark on request before the pulse was over");
  if (deadline.at < over) return fail(ErrorCode::timeout, "projector: the pulse was not over in time");
  return {};
}

Result<void> SimProjector::turn_off(Deadline) {
  request_off();
  return {};
}

void SimProjector::request_off() noexcept {
  const std::scoped_lock lock(state_.mutex);
  state_.dark_requested = true;
  state_.clock.notify_all(state_.changed);
}

Result<void> SimStereoCamera::arm(Deadline) {
  const std::scoped_lock lock(state_.mutex);
  state_.in_flight.reset();
  state_.triggers = 0;
  state_.armed = collectable_ = true;
  return {};
}

Result<void> SimStereoCamera::scale_exposure(double factor, Deadline) {
  const std::scoped_lock lock(state_.mutex);
  state_.exposure_factor = factor;
  return {};
}

Result<StereoFrame> SimStereoCamera::collect(Deadline deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  if (!collectable_) return fail(ErrorCode::protocol, "camera: nothing to collect: not armed");
  collectable_ = false;
  // First the edge, then the transfer of the frames.
  const bool exposed = b.clock.wait_until(lock, b.changed, deadline.at, [&b] { return b.in_flight.has_value(); });
  if (exposed) {
    const auto arrival = std::min(b.in_flight->arrival, deadline.at);
    b.clock.wait_until(lock, b.changed, arrival, [&b] { return !b.in_flight; });
  }
  b.armed = false;
  if (!b.in_flight || deadline.at < b.in_flight->arrival) {
    b.in_flight.reset();
    return fail(ErrorCode::timeout, "camera: no pair of frames in time; arm again and repeat the exposure");
  }
  const Exposure e = *b.in_flight;
  b.in_flight.reset();
  lock.unlock();
  return render(e);
}

StereoFrame SimStereoCamera::render(const Exposure& e) {
  SharedState& b = state_;
  if (e.board != 0 && e.board != board_) b.board.put(e.board);
  board_ = e.board;
  const double angle = to_radians(e.angle_deg);
  const double minutes = std::chrono::duration<double, std::ratio<60>>(e.taken - b.begun).count();
  const StereoImages images = e.board != 0 ? b.board.shoot(angle, e.number)
                                           : b.scene->shoot(e.placement, angle, e.pattern, e.number, minutes, e.factor);
  return StereoFrame{images.left, images.right, PixelFormat::bayer_rggb8, e.trigger, e.taken};
}

Result<StereoFrame> SimStereoCamera::capture_preview(Deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  b.armed = collectable_ = false;
  b.in_flight.reset();
  const auto now = b.clock.now();
  const Exposure seen{.placement = b.history.placement(),
                      .board = b.board_placement,
                      .angle_deg = b.true_angle_deg(now),
                      .pattern = false,
                      .factor = 1.0,
                      .number = Scene::kFirstPreview + previews_++,
                      .trigger = b.triggers,
                      .taken = now,
                      .arrival = now};
  lock.unlock();
  return render(seen);
}

Result<PanelInputs> SimPanel::wait_change(const PanelInputs& known, Deadline deadline) {
  SharedState& b = state_;
  std::unique_lock lock(b.mutex);
  for (Button* button : {&b.start, &b.stop, &b.reset}) {
    if (*button == Button::reported) *button = Button::released;
  }
  const auto inputs = [&b] {
    PanelInputs now;
    now.start = b.start != Button::released;
    now.stop = b.stop != Button::released;
    now.reset = b.reset != Button::released;
    now.estop_ok = b.estop_ok;
    now.guard_closed = b.guard_closed;
    return now;
  };
  b.clock.wait_until(lock, b.changed, deadline.at, [&] { return inputs() != known; });
  const PanelInputs now = inputs();
  for (Button* button : {&b.start, &b.stop, &b.reset}) {
    if (*button == Button::pressed) *button = Button::reported;
  }
  return now;
}

Result<void> SimPanel::show(const PanelOutputs& outputs, Deadline) {
  const std::scoped_lock lock(state_.mutex);
  state_.lamps = outputs;
  return {};
}

}  // namespace scanrig::sim
