#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>

#include "drivers/turntable/grbl_turntable.h"
#include "sim/wire/grbl_server.h"
#include "tests/component/turntable/turntable_bench.h"

namespace scanrig {

/// The shipped driver against the far end of the wire; a light table, so that real time is short.
class GrblBench : public TurntableBench {
 public:
  using Change = std::function<void(GrblTurntableOptions&, sim::wire::GrblSettings&)>;

  explicit GrblBench(const Change& change = [](auto&, auto&) {}) {
    sim::wire::GrblSettings settings{.homing_deg_s = 400, .acceleration_deg_s2 = 20000};
    options_.drive.link.device = link_;
    options_.drive.link.reply_timeout = std::chrono::milliseconds(30);
    options_.scale.gear_ratio = axis_.gear_ratio;
    options_.speed = {1800};
    options_.acceleration = {20000};
    options_.tolerance = {0.05};
    options_.settle = std::chrono::milliseconds(60);
    change(options_, settings);
    auto table = GrblTurntable::create(options_, clock_);
    EXPECT_TRUE(table) << table.error().message;
    table_ = std::move(*table);
    controller_ = std::make_unique<sim::wire::GrblController>(axis_, settings, clock_);
    auto server = sim::wire::GrblServer::start(link_, *controller_, clock_);
    EXPECT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
  }

  GrblTurntable& turntable() override { return *table_; }
  Clock& clock() override { return clock_; }
  double seen_deg() override { return controller_->truth().table_deg * (options_.scale.positive_ccw ? 1.0 : -1.0); }
  bool seen_moving() override { return controller_->truth().moving; }
  bool has_feedback() override { return false; }
  void block(bool blocked) override { controller_->block(blocked); }
  void when_moving(std::function<void()> act) override {
    onlooker_ = std::jthread([this, act = std::move(act)](const std::stop_token& stop) {
      while (!seen_moving()) {
        if (stop.stop_requested()) return;
        clock_.sleep_for(std::chrono::milliseconds(1));
      }
      act();
    });
  }
  Clock::Duration too_short() override { return std::chrono::milliseconds(60); }
  Degrees tolerance() override { return options_.tolerance; }

  const std::string& device() const { return link_; }
  sim::wire::GrblController& drive() { return *controller_; }
  sim::wire::GrblServer& server() { return *server_; }

 private:
  RealClock clock_;
  sim::wire::AxisOptions axis_{.gear_ratio = 9, .start_deg = 20};
  GrblTurntableOptions options_;
  std::string link_ = testing::TempDir() + "grbl" + std::to_string(::getpid()) + "-" +
                      std::to_string(reinterpret_cast<std::uintptr_t>(this));
  std::unique_ptr<sim::wire::GrblController> controller_;
  std::unique_ptr<sim::wire::GrblServer> server_;
  std::unique_ptr<GrblTurntable> table_;
  std::jthread onlooker_;
};

}  // namespace scanrig
