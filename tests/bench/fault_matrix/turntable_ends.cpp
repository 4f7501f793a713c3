#include <atomic>
#include <memory>

#include "config/drive_profile_file.h"
#include "drivers/turntable/grbl_turntable.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/wire/grbl_server.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/oriental_drive.h"
#include "tests/bench/fault_matrix/turntable_end.h"

namespace scanrig::bench {
namespace {

using sim::wire::WireFault;
using std::chrono::milliseconds;

constexpr milliseconds kReplyTimeout{30};
constexpr milliseconds kLate{50};  ///< later than the driver waits for any reply
constexpr std::uint8_t kReadFunction = 3;

std::string fresh_port(const std::filesystem::path& scratch) {
  static std::atomic<int> count = 0;
  return scratch / fmt::format("port{}", count++);
}

/// Common part of all ends: a drive that can fail, and a server whose line can fail.
class WireEnd : public TurntableEnd {
 public:
  Turntable& table() override { return *table_; }
  sim::wire::AxisTruth truth() override { return drive_->truth(); }

  void begin(Fault fault) override {
    using Kind = WireFault::Kind;
    // The drive still receives a stop; its own replies are damaged.
    const auto spoil = [&](Kind kind) { server_->inject({.kind = kind, .function = asks_, .delay = kLate}); };
    switch (fault) {
      case Fault::silent: return server_->inject({.kind = Kind::request_lost});
      case Fault::late: return spoil(Kind::late);
      case Fault::damaged: return spoil(Kind::wrong_crc);
      case Fault::earlier_answer: return spoil(Kind::earlier_reply);
      case Fault::device_error: return drive_->raise_alarm(alarm_, alarm_can_be_reset_);
      case Fault::stalled: return drive_->block(true);
      case Fault::unplugged:
      case Fault::back_after_2s: return server_->vanish();
    }
  }
  void end(Fault) override {
    server_->clear_faults();
    drive_->block(false);
    std::ignore = server_->come_back();
  }
  void send_round() override { drive_->send(200'000); }  // 800 deg
  void raise_alarm(bool can_be_reset) override {
    alarm_can_be_reset_ = can_be_reset;
    drive_->raise_alarm(alarm_, can_be_reset);
  }
  void power_cycle() override {
    alarm_can_be_reset_ = true;
    drive_->power_cycle();
  }

 protected:
  inline static const sim::wire::AxisOptions kAxis{.gear_ratio = kGear, .start_deg = 20};

  WireEnd(std::uint8_t asks, std::uint16_t alarm) : asks_(asks), alarm_(alarm) {}
  static void set_motion(AxisTurntableOptions& options) {
    options.scale.gear_ratio = kGear;
    options.speed = {kSpeedDegS};
    options.acceleration = {kAccelerationDegS2};
    options.tolerance = {kToleranceDeg};
    options.settle = milliseconds(60);
  }
  template <class Server, class Drive, class... More>
  void serve(std::unique_ptr<Drive> drive, const std::string& port, Clock& clock, More... more) {
    server_ = Server::start(port, more..., *drive, clock).value();
    drive_ = std::move(drive);
  }

  std::unique_ptr<Turntable> table_;

 private:
  const std::uint8_t asks_;  ///< the function that only reads
  const std::uint16_t alarm_;
  bool alarm_can_be_reset_ = true;
  std::unique_ptr<sim::wire::SimulatedDrive> drive_;
  std::unique_ptr<sim::wire::WireServer> server_;
};

template <class Drive>
class ModbusEnd final : public WireEnd {
 public:
  ModbusEnd(const std::filesystem::path& scratch, const DriveProfile& profile, std::uint16_t alarm, Clock& clock)
      : WireEnd(kReadFunction, alarm) {
    ModbusTurntableOptions options;
    set_motion(options);
    options.line.device = fresh_port(scratch);
    options.line.reply_timeout = kReplyTimeout;
    options.profile = profile;
    if (profile.homing.absolute) options.home_mode = "absolute";
    serve<sim::wire::ModbusServer>(std::make_unique<Drive>(kAxis, clock), options.line.device, clock, std::uint8_t{1});
    table_ = ModbusTurntable::create(options, clock).value();
  }
};

class GrblEnd final : public WireEnd {
 public:
  GrblEnd(const std::filesystem::path& scratch, Clock& clock) : WireEnd('?', 1) {
    GrblTurntableOptions options;
    set_motion(options);
    options.drive.link.device = fresh_port(scratch);
    options.drive.link.reply_timeout = kReplyTimeout;
    const sim::wire::GrblSettings settings{.homing_deg_s = 200, .acceleration_deg_s2 = kAccelerationDegS2};
    serve<sim::wire::GrblServer>(std::make_unique<sim::wire::GrblController>(kAxis, settings, clock),
                                 options.drive.link.device, clock);
    table_ = GrblTurntable::create(options, clock).value();
  }
};

/// Far end that implements a profile, and one of its alarms.
std::unique_ptr<TurntableEnd> modbus_end(const std::filesystem::path& scratch, const DriveProfile& profile,
                                         Clock& clock) {
  if (profile.name == "oriental-az") {
    return std::make_unique<ModbusEnd<sim::wire::OrientalDrive>>(scratch, profile, 0x10, clock);
  }
  return std::make_unique<ModbusEnd<sim::wire::LeadshineDrive>>(scratch, profile, 0x20, clock);
}

}  // namespace

std::vector<TurntableKind> shipped_turntables(const std::filesystem::path& scratch,
                                              const std::filesystem::path& profiles) {
  std::vector<TurntableKind> kinds;
  for (const char* name : {"leadshine-rs", "oriental-az"}) {
    const auto profile = config::read_drive_profile(profiles / (std::string(name) + ".toml")).value();
    kinds.push_back(
        {"ModbusTurntable", name, [scratch, profile](Clock& clock) { return modbus_end(scratch, profile, clock); }});
  }
  kinds.push_back({"GrblTurntable", "", [scratch](Clock& clock) { return std::make_unique<GrblEnd>(scratch, clock); }});
  return kinds;
}

}  // namespace scanrig::bench
