#pragma once

#include <atomic>

#include "drivers/projector/lightcrafter_projector.h"
#include "sim/wire/lightcrafter.h"
#include "tests/component/projector/projector_compliance.h"

namespace scanrig {

/// Transport between driver and simulated device instead of USB; the device logs each report.
class SimulatedUsb final : public dlpc350::Transport {
 public:
  SimulatedUsb(sim::wire::LightCrafter& device, const std::atomic<bool>& plugged, Clock& clock)
      : device_(device), plugged_(plugged), clock_(clock), enumeration_(device.enumeration()) {}

  Result<void> send(const dlpc350::Report& report, Deadline) override {
    if (is_gone()) return gone();
    device_.receive(report);
    return {};
  }
  Result<dlpc350::Report> receive(Deadline deadline) override {
    for (;;) {
      if (is_gone()) return pass_on(Result<void>(gone()));
      if (const auto report = device_.next_report()) return *report;
      if (deadline.expired(clock_)) return fail(ErrorCode::timeout, "no reply");
      clock_.sleep_for(std::chrono::milliseconds(1));
    }
  }

 private:
  [[nodiscard]] bool is_gone() const { return !plugged_ || device_.enumeration() != enumeration_; }
  static tl::unexpected<Error> gone() { return fail(ErrorCode::io, "No such device (it may have been disconnected)"); }

  sim::wire::LightCrafter& device_;
  const std::atomic<bool>& plugged_;
  Clock& clock_;
  const int enumeration_;
};

class LightCrafterBench : public ProjectorBench {
 public:
  using Change = std::function<void(LightCrafterOptions&)>;

  explicit LightCrafterBench(const Change& change = [](auto&) {}) {
    LightCrafterOptions options;
    options.image = 5;
    options.pattern = 3;
    options.exposure = std::chrono::milliseconds(12);
    options.reply_timeout = std::chrono::milliseconds(100);
    change(options);
    auto created = LightCrafterProjector::create(options, transport(), clock_);
    EXPECT_TRUE(created) << created.error().message;
    if (created) projector_ = std::move(*created);
  }

  /// Opens a connection to the device, as often as it is called.
  dlpc350::OpenTransport transport() {
    return [this]() -> Result<std::unique_ptr<dlpc350::Transport>> {
      if (!plugged_) return fail(ErrorCode::not_found, "LightCrafter: no LightCrafter 4500 on USB");
      return std::make_unique<SimulatedUsb>(device_, plugged_, clock_);
    };
  }
  LightCrafterProjector& projector() override { return *projector_; }
  Clock& clock() override { return clock_; }
  sim::wire::LightCrafter& device() { return device_; }
  std::vector<Flash> seen() override {
    std::vector<Flash> seen;
    for (const auto& flash : device_.flashes()) seen.push_back({flash.white ? Light::plain : Light::pattern, flash.at});
    return seen;
  }
  bool seen_lit() override { return device_.lit(); }
  void when_lit(std::function<void()> act) override {
    device_.on_trigger_out([this, act = std::move(act)](const auto&) {
      act();
      device_.on_trigger_out({});
    });
  }
  Clock::Duration exposure() const override { return std::chrono::milliseconds(12); }
  void plug(bool in) override { plugged_ = in; }

 private:
  RealClock clock_;
  sim::wire::LightCrafter device_{clock_};
  std::atomic<bool> plugged_ = true;
  std::unique_ptr<LightCrafterProjector> projector_;
};

}  // namespace scanrig
