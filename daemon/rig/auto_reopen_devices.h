#pragma once

#include <functional>
#include <memory>
#include <mutex>

#include "drivers/panel/panel.h"
#include "drivers/projector/projector.h"

namespace scanrig {

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
