#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "daemon/runtime/device_watch.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"
#include "drivers/turntable/turntable.h"

namespace scanrig {

/// The devices of the rig, opened by main(); they outlive the daemon.
struct Devices {
  Turntable& turntable;
  Projector& projector;
  StereoCamera& camera;
  Panel& panel;
};

/// Devices whose every call is recorded in a DeviceWatch while it lasts. The device outlives its wrapper.
/// To add a call to a device's interface: forward it here with a Call of its name.

class WatchedTurntable final : public Turntable {
 public:
  WatchedTurntable(Turntable& turntable, const Clock& clock, Clock::Duration margin)
      : turntable_(turntable), clock_(clock), watch_(clock, "turntable", margin) {}

  Result<void> home(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "home", deadline);
    return turntable_.home(deadline);
  }
  Result<Move> rotate_to(Degrees target, Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "rotate_to", deadline);
    return turntable_.rotate_to(target, deadline);
  }
  Result<void> stop(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "stop", deadline);
    return turntable_.stop(deadline);
  }
  Result<void> reset_alarm(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "reset_alarm", deadline);
    return turntable_.reset_alarm(deadline);
  }
  Result<TurntableStatus> status(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "status", deadline);
    return turntable_.status(deadline);
  }
  Result<void> limit_speed(std::optional<DegreesPerSecond> limit) override {
    const DeviceWatch::Call call(watch_, "limit_speed", Deadline::after(clock_, kSpeedLimit));
    return turntable_.limit_speed(limit);
  }
  void request_stop() noexcept override { turntable_.request_stop(); }
  void drop_stop_request() noexcept override { turntable_.drop_stop_request(); }

  [[nodiscard]] std::optional<HungCall> hung() const { return watch_.hung(); }

 private:
  static constexpr auto kSpeedLimit = std::chrono::seconds(1);  ///< limit_speed() has no deadline of its own

  Turntable& turntable_;
  const Clock& clock_;
  DeviceWatch watch_;
};

class WatchedProjector final : public Projector {
 public:
  WatchedProjector(Projector& projector, const Clock& clock, Clock::Duration margin)
      : projector_(projector), watch_(clock, "projector", margin) {}

  Result<void> fire(Light light, Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "fire", deadline);
    return projector_.fire(light, deadline);
  }
  Result<void> turn_off(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "turn_off", deadline);
    return projector_.turn_off(deadline);
  }
  void request_off() noexcept override { projector_.request_off(); }

  [[nodiscard]] std::optional<HungCall> hung() const { return watch_.hung(); }

 private:
  Projector& projector_;
  DeviceWatch watch_;
};

class WatchedCamera final : public StereoCamera {
 public:
  WatchedCamera(StereoCamera& camera, const Clock& clock, Clock::Duration margin)
      : camera_(camera), watch_(clock, "camera", margin) {}

  Result<void> prepare(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "prepare", deadline);
    return camera_.prepare(deadline);
  }
  Result<void> scale_exposure(double factor, Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "scale_exposure", deadline);
    return camera_.scale_exposure(factor, deadline);
  }
  Result<void> arm(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "arm", deadline);
    return camera_.arm(deadline);
  }
  Result<StereoFrame> collect(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "collect", deadline);
    return camera_.collect(deadline);
  }
  Result<StereoFrame> capture_preview(Deadline deadline) override {
    const DeviceWatch::Call call(watch_, "capture_preview", deadline);
    return camera_.capture_preview(deadline);
  }

  [[nodiscard]] std::optional<HungCall> hung() const { return watch_.hung(); }

 private:
  StereoCamera& camera_;
  DeviceWatch watch_;
};

/// A panel that hung has failed, whatever it returns in the end: the hang has been reported to the station.
class WatchedPanel final : public Panel {
 public:
  /// `read_time`: time a reading may take beyond its deadline.
  WatchedPanel(Panel& panel, const Clock& clock, Clock::Duration margin, Clock::Duration read_time)
      : panel_(panel), read_time_(read_time), watch_(clock, "panel", margin) {}

  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override {
    DeviceWatch::Call call(watch_, "wait_change", {deadline.at + read_time_});
    auto inputs = panel_.wait_change(known, deadline);
    if (const auto hung = call.end(); hung && inputs) return tl::unexpected(hung_error(*hung));
    return inputs;
  }
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override {
    DeviceWatch::Call call(watch_, "show", deadline);
    auto shown = panel_.show(outputs, deadline);
    if (const auto hung = call.end(); hung && shown) return tl::unexpected(hung_error(*hung));
    return shown;
  }

  [[nodiscard]] std::optional<HungCall> hung() const { return watch_.hung(); }

 private:
  Panel& panel_;
  const Clock::Duration read_time_;
  DeviceWatch watch_;
};

/// A device that may be missing: its first use opens it, and so does the next use after a failure with `io`. Until then
/// every use fails as opening does. The rest of the rig runs on, and the device returns without a restart.
template <class Device>
class AutoReopen {
 public:
  using Open = std::function<Result<std::unique_ptr<Device>>()>;
  explicit AutoReopen(Open open) : open_(std::move(open)) {}

  template <class Use>
  auto use(const Use& what) -> decltype(what(std::declval<Device&>())) {
    auto device = opened();
    if (!device) return pass_on(device);
    auto done = what(**device);
    if (!done && done.error().code == ErrorCode::io) forget();
    return done;
  }
  /// The device if it is open. From any thread.
  std::shared_ptr<Device> open_device() {
    const std::lock_guard guard(mutex_);
    return device_;
  }

 private:
  Result<std::shared_ptr<Device>> opened() {
    if (auto device = open_device()) return device;
    auto made = open_();
    if (!made) return pass_on(made);
    std::shared_ptr<Device> device = std::move(*made);
    const std::lock_guard guard(mutex_);
    device_ = device;
    return device;
  }
  void forget() {
    const std::lock_guard guard(mutex_);
    device_.reset();
  }

  const Open open_;
  std::mutex mutex_;
  std::shared_ptr<Device> device_;
};

class AutoReopenProjector final : public Projector {
 public:
  explicit AutoReopenProjector(AutoReopen<Projector>::Open open) : projector_(std::move(open)) {}
  Result<void> fire(Light light, Deadline deadline) override {
    return projector_.use([&](Projector& p) { return p.fire(light, deadline); });
  }
  Result<void> turn_off(Deadline deadline) override {
    return projector_.use([&](Projector& p) { return p.turn_off(deadline); });
  }
  void request_off() noexcept override {
    if (const auto projector = projector_.open_device()) projector->request_off();
  }

 private:
  AutoReopen<Projector> projector_;
};

/// Devices that another program has: every use fails and says so, but stop(), which is `make_safe`. That has to free
/// the drive and stop it by another path; once it has succeeded nothing can have moved since, and it is not repeated.
class LentDevices final : Turntable, Projector, StereoCamera, Panel {
 public:
  explicit LentDevices(std::function<Result<void>()> make_safe) : make_safe_(std::move(make_safe)) {}
  Devices devices() { return {*this, *this, *this, *this}; }

 private:
  template <class Value = void>
  static Result<Value> lent(std::string_view device) {
    return fail(ErrorCode::busy, "{}: lent to setup", device);
  }
  Result<void> home(Deadline) override { return lent("turntable"); }
  Result<Move> rotate_to(Degrees, Deadline) override { return lent<Move>("turntable"); }
  Result<void> stop(Deadline) override {
    const std::lock_guard guard(mutex_);
    if (is_safe_) return {};
    auto made = make_safe_();
    is_safe_ = made.has_value();
    return made;
  }
  Result<void> reset_alarm(Deadline) override { return lent("turntable"); }
  Result<TurntableStatus> status(Deadline) override { return lent<TurntableStatus>("turntable"); }
  void request_stop() noexcept override {}
  void drop_stop_request() noexcept override {}
  Result<void> fire(Light, Deadline) override { return lent("projector"); }
  Result<void> turn_off(Deadline) override { return lent("projector"); }
  void request_off() noexcept override {}
  Result<void> prepare(Deadline) override { return lent("camera"); }
  Result<void> arm(Deadline) override { return lent("camera"); }
  Result<StereoFrame> collect(Deadline) override { return lent<StereoFrame>("camera"); }
  Result<StereoFrame> capture_preview(Deadline) override { return lent<StereoFrame>("camera"); }
  Result<PanelInputs> wait_change(const PanelInputs&, Deadline) override { return lent<PanelInputs>("panel"); }
  Result<void> show(const PanelOutputs&, Deadline) override { return lent("panel"); }

  const std::function<Result<void>()> make_safe_;
  std::mutex mutex_;
  bool is_safe_ = false;
};

class AutoReopenPanel final : public Panel {
 public:
  explicit AutoReopenPanel(AutoReopen<Panel>::Open open) : panel_(std::move(open)) {}
  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override {
    return panel_.use([&](Panel& p) { return p.wait_change(known, deadline); });
  }
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override {
    return panel_.use([&](Panel& p) { return p.show(outputs, deadline); });
  }

 private:
  AutoReopen<Panel> panel_;
};

}  // namespace scanrig
