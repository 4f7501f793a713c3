#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>

#include "config/drive_profile_file.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/oriental_drive.h"
#include "tests/component/turntable/turntable_bench.h"

namespace scanrig {

/// The shipped driver and profile against the far end of the wire; a light table, so that real time is short.
class ModbusBench : public TurntableBench {
 public:
  using Change = std::function<void(ModbusTurntableOptions&)>;

  explicit ModbusBench(
      const Change& change = [](auto&) {}, const std::string& profile_name = "leadshine-rs") {
    auto profile = config::read_drive_profile(SCANRIG_SOURCE_DIR "/config/drives/" + profile_name + ".toml");
    EXPECT_TRUE(profile) << profile.error().message;
    ModbusTurntableOptions options;
    options.line.device = link_;
    options.profile = *profile;
    options.home_mode = profile->homing.modes.contains("switch") ? "switch" : profile->homing.modes.begin()->first;
    options.scale.gear_ratio = axis_.gear_ratio;
    options.speed = {1800};
    options.acceleration = {20000};
    options.tolerance = {0.05};
    options.settle = std::chrono::milliseconds(60);
    options.line.reply_timeout = std::chrono::milliseconds(30);
    change(options);
    options_ = options;
    auto table = ModbusTurntable::create(options, clock_);
    EXPECT_TRUE(table) << table.error().message;
    table_ = std::move(*table);
    const bool oriental = profile_name == "oriental-az";
    drive_ = oriental ? static_cast<sim::wire::Mechanics*>(&oriental_) : &leadshine_;
    sim::wire::RegisterDevice& registers = oriental ? static_cast<sim::wire::RegisterDevice&>(oriental_) : leadshine_;
    auto server = sim::wire::ModbusServer::start(link_, 1, registers, clock_);
    EXPECT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
  }

  ModbusTurntable& turntable() override { return *table_; }
  Clock& clock() override { return clock_; }
  double seen_deg() override { return drive_->truth().table_deg * (options_.scale.positive_ccw ? 1.0 : -1.0); }
  bool seen_moving() override { return drive_->truth().moving; }
  void block(bool blocked) override { drive_->block(blocked); }
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
  sim::wire::Mechanics& drive() { return *drive_; }
  sim::wire::LeadshineDrive& leadshine() { return leadshine_; }
  sim::wire::ModbusServer& server() { return *server_; }

 private:
  RealClock clock_;
  sim::wire::AxisOptions axis_{.gear_ratio = 9, .start_deg = 20};
  sim::wire::LeadshineDrive leadshine_{axis_, clock_};
  sim::wire::OrientalDrive oriental_{axis_, clock_};
  sim::wire::Mechanics* drive_ = nullptr;  // the one on the wire
  std::string link_ = testing::TempDir() + "turntable" + std::to_string(::getpid()) + "-" +
                      std::to_string(reinterpret_cast<std::uintptr_t>(this));
  ModbusTurntableOptions options_;
  std::unique_ptr<sim::wire::ModbusServer> server_;
  std::unique_ptr<ModbusTurntable> table_;
  std::jthread onlooker_;
};

}  // namespace scanrig
