#pragma once

#include <string_view>

#include "config/drive_profile_file.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/oriental_drive.h"
#include "tests/component/turntable/wire_bench.h"

namespace scanrig {

/// A shipped profile, and the matching far end.
struct ModbusKind {
  std::string_view profile;
  std::string_view home_mode;

  [[nodiscard]] DriveProfile read() const {
    auto read = config::read_drive_profile(std::string(SCANRIG_SOURCE_DIR "/config/drives/").append(profile) + ".toml");
    EXPECT_TRUE(read) << read.error().message;
    return *read;
  }
};
inline constexpr ModbusKind kLeadshine{"leadshine-rs", "switch"};
inline constexpr ModbusKind kOriental{"oriental-az", "absolute"};

/// The shipped driver with a shipped profile.
class ModbusBench : public WireBench {
 public:
  using Change = std::function<void(ModbusTurntableOptions&)>;

  explicit ModbusBench(
      const ModbusKind& kind, const Change& change = [](auto&) {})
      : WireBench("turntable") {
    lighten(options_);
    options_.line.device = link_;
    options_.line.reply_timeout = std::chrono::milliseconds(30);
    options_.profile = kind.read();
    options_.home_mode = kind.home_mode;
    change(options_);
    auto server =
        kind.profile == kOriental.profile ? serve<sim::wire::OrientalDrive>() : serve<sim::wire::LeadshineDrive>();
    far_end_ = server ? server->get() : nullptr;
    table_ = connect(ModbusTurntable::create(options_, clock_), std::move(server), options_.scale.positive_ccw);
  }

  Counted counted() const override { return {table_->statistics().corrupt, table_->statistics().retries}; }

  const ModbusTurntableOptions& options() const { return options_; }
  sim::wire::RegisterDevice& registers() { return *registers_; }
  /// Receives every request before it is carried out.
  void on_request(std::function<void(const sim::wire::ModbusRequest&)> listener) {
    far_end_->on_request(std::move(listener));
  }

 private:
  template <class Drive>
  Result<std::unique_ptr<sim::wire::ModbusServer>> serve() {
    auto drive = std::make_unique<Drive>(axis_, clock_);
    registers_ = drive.get();
    drive_ = std::move(drive);
    return sim::wire::ModbusServer::start(link_, 1, *registers_, clock_);
  }

  ModbusTurntableOptions options_;
  sim::wire::RegisterDevice* registers_ = nullptr;
  sim::wire::ModbusServer* far_end_ = nullptr;
  ModbusTurntable* table_ = nullptr;
};

}  // namespace scanrig
