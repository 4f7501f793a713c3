#include "daemon/rig/acquisition.h"

#include "daemon/station/timestamp.h"

namespace scanrig {
namespace {

double milliseconds(Clock::Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

bool is_lost(const Error& error) { return error.code == ErrorCode::timeout || error.code == ErrorCode::protocol; }

}  // namespace

Result<void> Acquisition::home() {
  if (auto dark = devices_.projector.dark(Deadline::after(clock_, options_.exposure_limit)); !dark) {
    return pass_on(dark, "projector");
  }
  if (auto reset = devices_.turntable.reset_alarm(Deadline::after(clock_, options_.stop_limit)); !reset) {
    return pass_on(reset, "turntable");
  }
  if (auto home = devices_.turntable.home(Deadline::after(clock_, options_.home_limit)); !home) {
    return pass_on(home, "turntable");
  }
  return {};
}

Result<TakenView> Acquisition::take_view(const ViewId& id, Degrees angle) {
  const Degrees turns{360.0 * id.pose};
  const auto move = devices_.turntable.rotate_to(turns + angle, Deadline::after(clock_, options_.move_limit));
  if (!move) return pass_on(move, "turntable");

  TakenView view{.id = id};
  const auto pattern = expose(Light::pattern, view.redone);
  if (!pattern) return pass_on(pattern);
  const auto plain = expose(Light::plain, view.redone);
  if (!plain) return pass_on(plain);

  view.record.index = id.view;
  view.record.commanded_deg = angle.value;
  view.record.measured_deg = (move->measured - turns).value;
  view.record.moving_ms = milliseconds(move->moving);
  view.record.settling_ms = milliseconds(move->settling);
  view.record.taken = iso_time(std::chrono::system_clock::now());
  view.record.pixel_format = to_string(pattern->format);
  view.images = {view.record.pixel_format, pattern->left, pattern->right, plain->left, plain->right};
  return view;
}

Result<void> Acquisition::stop() {
  const auto deadline = Deadline::after(clock_, options_.stop_limit);
  const auto dark = devices_.projector.dark(deadline);
  const auto stopped = devices_.turntable.stop(deadline);
  if (!stopped) return pass_on(stopped, "turntable");
  if (!dark) return pass_on(dark, "projector");
  return {};
}

Result<StereoFrame> Acquisition::expose(Light light, int& redone) {
  auto frame = expose_once(light);
  for (int i = 0; i < options_.redo_limit && !frame && is_lost(frame.error()); ++i) {
    ++redone;
    frame = expose_once(light);
  }
  return frame;
}

Result<StereoFrame> Acquisition::expose_once(Light light) {
  if (auto armed = devices_.camera.arm(Deadline::after(clock_, options_.exposure_limit)); !armed) {
    return pass_on(armed, "camera");
  }
  if (auto fired = devices_.projector.fire(light, Deadline::after(clock_, options_.exposure_limit)); !fired) {
    return pass_on(fired, "projector");
  }
  auto frame = devices_.camera.collect(Deadline::after(clock_, options_.exposure_limit));
  if (!frame) return pass_on(frame, "camera");
  return frame;
}

}  // namespace scanrig
