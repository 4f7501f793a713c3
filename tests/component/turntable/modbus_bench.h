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

/// A shipped profile, and the far end that it fits.
struct ModbusKind {
  const char* profile;
  const char* home_mode;

  [[nodiscard]] DriveProfile read() const {
    auto read = config::read_drive_profile(std::string(SCANRIG_SOURCE_DIR "/config/drives/") + profile + ".toml");
    EXPECT_TRUE(read) << read.error().message;
    return *read;
  }
};
inline constexpr ModbusKind kLeadshine{"leadshine-rs", "switch"};
inline constexpr ModbusKind kOriental{"oriental-az", "absolute"};

/// The shipped driver and profile against the far end of the wire; a light table, so that real time is short.
class ModbusBench : public TurntableBench {
 public:
  using Change = std::function<void(ModbusTurntableOptions&)>;

  explicit ModbusBench(
      const ModbusKind& kind, const Change& change = [](auto&) {}) {
    ModbusTurntableOptions options;
    options.line.device = link_;
    options.profile = kind.read();
    options.home_mode = kind.home_mode;
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
    auto server =
        kind.profile == kOriental.profile ? serve<sim::wire::OrientalDrive>() : serve<sim::wire::LeadshineDrive>();
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
  const ModbusTurntableOptions& options() const { return options_; }
  sim::wire::SimulatedDrive& drive() { return *drive_; }
  sim::wire::RegisterDevice& registers() { return *registers_; }
  sim::wire::ModbusServer& server() { return *server_; }

 private:
  template <class Drive>
  Result<std::unique_ptr<sim::wire::ModbusServer>> serve() {
    auto drive = std::make_unique<Drive>(axis_, clock_);
    registers_ = drive.get();
    drive_ = std::move(drive);
    return sim::wire::ModbusServer::start(link_, 1, *registers_, clock_);
  }

  RealClock clock_;
  sim::wire::AxisOptions axis_{.gear_ratio = 9, .start_deg = 20};
  std::unique_ptr<sim::wire::SimulatedDrive> drive_;
  sim::wire::RegisterDevice* registers_ = nullptr;
  std::string link_ = testing::TempDir() + "turntable" + std::to_string(::getpid()) + "-" +
                      std::to_string(reinterpret_cast<std::uintptr_t>(this));
  ModbusTurntableOptions options_;
  std::unique_ptr<sim::wire::ModbusServer> server_;
  std::unique_ptr<ModbusTurntable> table_;
  std::jthread onlooker_;
};

}  // namespace scanrig
