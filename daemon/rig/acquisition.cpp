#include "daemon/rig/acquisition.h"

#include <cmath>
#include <utility>

#include "core/timestamp.h"
#include "daemon/rig/exposure_choice.h"

namespace scanrig {
namespace {

double milliseconds(Clock::Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

constexpr auto kTurntable = "turntable", kProjector = "projector", kCamera = "camera";

constexpr double kMaxWound = 4 * 360.0;

/// `angle` plus as many whole turns as bring it nearest to `to`.
double nearest_turn(double angle, double to) { return angle + 360.0 * std::round((to - angle) / 360.0); }

Result<TurntableStatus> known_motion(Result<TurntableStatus> status) {
  if (!status || status->motion != TurntableStatus::Motion::unknown) return status;
  return fail(ErrorCode::timeout, "turntable: its drive cannot be reached; check its power and cable");
}

/// Failures that the same exposure, taken again, may not have: lost frames, a plug pulled and put back.
bool may_pass(const Error& error) {
  return error.code == ErrorCode::timeout || error.code == ErrorCode::protocol || error.code == ErrorCode::io ||
         error.code == ErrorCode::not_found;
}

}  // namespace

Result<void> Acquisition::home() {
  if (auto dark = from(kProjector, devices_.projector.turn_off(Deadline::after(clock_, options_.fire_limit))); !dark) {
    return pass_on(dark);
  }
  if (auto reset = from(kTurntable, devices_.turntable.reset_alarm(Deadline::after(clock_, options_.stop_limit)));
      !reset) {
    return pass_on(reset);
  }
  position_deg_ = 0.0;
  if (auto home = from(kTurntable, devices_.turntable.home(Deadline::after(clock_, options_.home_limit))); !home) {
    return pass_on(home);
  }
  return {};
}

Result<TakenView> Acquisition::take_view(const ViewId& id, Degrees angle, ViewExposures exposures) {
  const unsigned before = interrupts_;
  if (id.job != std::exchange(job_, id.job)) image_checker_.begin();
  judges_images_ = exposures != ViewExposures::plain_only;
  // The cameras are prepared before the table has stopped. If they fail, the exposure returns the error.
  std::ignore = devices_.camera.prepare(Deadline::after(clock_, options_.connect_limit));
  const auto move = turn_to(angle);
  if (!move) return pass_on(move);
  if (auto usual = set_exposure(1.0); !usual) return pass_on(usual);

  TakenView view{.id = id};
  StereoFrame pattern;
  if (judges_images_) {
    auto taken = expose(Light::pattern, before, view.record.retake_reasons);
    if (!taken) return pass_on(taken);
    pattern = std::move(*taken);
  }
  const auto plain = expose(Light::plain, before, view.record.retake_reasons);
  if (!plain) return pass_on(plain);

  view.record.index = id.view;
  view.record.commanded_deg = move->commanded.value;
  view.record.measured_deg = move->measured.value;
  view.record.moving_ms = milliseconds(move->moving);
  view.record.settling_ms = milliseconds(move->settling);
  view.record.taken = iso_time(std::chrono::system_clock::now());
  view.record.pixel_format = to_string(plain->format);
  view.images = {view.record.pixel_format, pattern.left, pattern.right, plain->left, plain->right};
  if (exposures == ViewExposures::all) {
    if (auto added = add_exposures(view, before); !added) return pass_on(added);
  }
  return view;
}

Result<void> Acquisition::add_exposures(TakenView& view, unsigned before) {
  const RawView& seen = view.images;
  const auto factors = wanted_exposures({{seen.left_pattern, seen.left_plain}, {seen.right_pattern, seen.right_plain}},
                                        options_.pattern_factors);
  judges_images_ = false;  // parts of them are meant to be dark or overexposed
  for (const double factor : factors) {
    if (auto set = set_exposure(factor); !set) return set;
    auto taken = expose(Light::pattern, before, view.record.retake_reasons);
    const auto usual = set_exposure(1.0);
    if (!taken) return pass_on(taken);
    if (!usual) return usual;
    view.images.more_patterns.push_back({factor, taken->left, taken->right});
  }
  return {};
}

/// After a failure the time is set again before the next view.
Result<void> Acquisition::set_exposure(double factor) {
  if (exposure_ == factor) return {};
  exposure_.reset();
  auto set = from(kCamera, devices_.camera.scale_exposure(factor, Deadline::after(clock_, options_.camera_limit)));
  if (set) exposure_ = factor;
  return set;
}

Result<Degrees> Acquisition::jog(const action::Jog& jog) {
  if (auto limited = from(kTurntable, devices_.turntable.limit_speed(jog.speed)); !limited) return pass_on(limited);
  const Degrees target{jog.angle.value + (jog.relative ? position_deg_ : 0.0)};
  auto move = from(kTurntable, devices_.turntable.rotate_to(target, Deadline::after(clock_, options_.move_limit)));
  auto free = from(kTurntable, devices_.turntable.limit_speed(std::nullopt));
  if (!move) return pass_on(move);
  if (!free) return pass_on(free);
  position_deg_ = move->commanded.value;
  return move->measured;
}

Result<void> Acquisition::pulse() {
  return from(kProjector, devices_.projector.fire(Light::pattern, Deadline::after(clock_, options_.fire_limit)));
}

Result<StereoFrame> Acquisition::capture_preview() {
  return devices_.camera.capture_preview(Deadline::after(clock_, options_.camera_limit));
}

event::DevicesChecked Acquisition::check() {
  const auto limit = [this] { return Deadline::after(clock_, options_.check_limit); };
  const auto health = [](const char* name, const auto& answer) {
    return DeviceHealth{name, answer ? std::nullopt : std::optional(answer.error())};
  };
  const auto status = known_motion(devices_.turntable.status(limit()));
  // Before the projector, which may be fired by a camera.
  const auto camera = health(kCamera, devices_.camera.prepare(Deadline::after(clock_, options_.connect_limit)));
  const auto projector = health(kProjector, devices_.projector.turn_off(limit()));
  event::DevicesChecked seen{{health(kTurntable, status), projector, camera}};
  if (status) seen.drive = event::DriveReport{status->motion == TurntableStatus::Motion::moving, status->alarm};
  return seen;
}

Acquisition::Stop Acquisition::stop() {
  const auto deadline = Deadline::after(clock_, options_.stop_limit);
  const auto dark = devices_.projector.turn_off(deadline);
  return {devices_.turntable.stop(deadline), dark};
}

Result<Move> Acquisition::turn_to(Degrees angle) {
  double target = nearest_turn(angle.value, position_deg_);
  if (std::abs(target) > kMaxWound) target = angle.value;
  auto move = from(kTurntable, devices_.turntable.rotate_to({target}, Deadline::after(clock_, options_.move_limit)));
  if (!move) return move;
  position_deg_ = target;
  // Some turntables count turns, some do not: the recorded angle is the angle within the requested turn.
  move->commanded = angle;
  move->measured.value = nearest_turn(move->measured.value, angle.value);
  return move;
}

Result<StereoFrame> Acquisition::expose(Light light, unsigned before, std::vector<Error>& retake_reasons) {
  for (int i = 0;; ++i) {
    if (interrupts_ != before) {
      failed_.clear();
      return fail(ErrorCode::stopped, "rig: stopped on request before the exposure");
    }
    auto frame = expose_once(light);
    if (frame || !may_pass(frame.error()) || i == options_.retake_limit || interrupts_ != before) return frame;
    retake_reasons.push_back(frame.error());
  }
}

Result<StereoFrame> Acquisition::expose_once(Light light) {
  if (auto armed = from(kCamera, devices_.camera.arm(Deadline::after(clock_, options_.camera_limit))); !armed) {
    return pass_on(armed);
  }
  if (auto fired = from(kProjector, devices_.projector.fire(light, Deadline::after(clock_, options_.fire_limit)));
      !fired) {
    return pass_on(fired);
  }
  auto frame = from(kCamera, devices_.camera.collect(Deadline::after(clock_, options_.camera_limit)));
  if (!frame) return frame;
  if (judges_images_) {
    if (auto good = from(kCamera, image_checker_.judge(light, *frame)); !good) return pass_on(good);
  }
  if (exposure_ == 1.0) seen_(*frame);
  return frame;
}

}  // namespace scanrig
