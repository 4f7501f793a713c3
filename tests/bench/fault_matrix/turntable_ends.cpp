#include <atomic>
#include <fstream>

#include "config/drive_profile_file.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "tests/bench/fault_matrix/turntable_end.h"

namespace scanrig::bench {
namespace {

using sim::wire::WireFault;
using std::chrono::milliseconds;

constexpr milliseconds kReplyTimeout{30};
constexpr milliseconds kLate{50};  ///< later than any answer is waited for
constexpr std::uint8_t kReadFunction = 3;

std::string fresh_port(const std::filesystem::path& scratch) {
  static std::atomic<int> count = 0;
  return scratch / fmt::format("port{}", count++);
}

class LeadshineEnd final : public TurntableEnd {
 public:
  LeadshineEnd(const std::filesystem::path& scratch, const DriveProfile& profile, Clock& clock)
      : drive_({.gear_ratio = kGear, .start_deg = 20}, clock) {
    ModbusTurntableOptions options;
    options.line.device = fresh_port(scratch);
    options.line.reply_timeout = kReplyTimeout;
    options.profile = profile;
    options.scale.gear_ratio = kGear;
    options.speed = {kSpeedDegS};
    options.acceleration = {kAccelerationDegS2};
    options.tolerance = {kToleranceDeg};
    options.settle = milliseconds(60);
    server_ = sim::wire::ModbusServer::start(options.line.device, 1, drive_, clock).value();
    table_ = ModbusTurntable::create(options, clock).value();
  }

  Turntable& table() override { return *table_; }
  sim::wire::AxisTruth truth() override { return drive_.truth(); }

  void begin(Fault fault) override {
    using Kind = WireFault::Kind;
    const auto spoil = [&](Kind kind) { server_->inject({.kind = kind, .function = kReadFunction, .delay = kLate}); };
    switch (fault) {
      case Fault::silent: return server_->inject({.kind = Kind::deaf});
      case Fault::late: return spoil(Kind::late);
      case Fault::damaged: return spoil(Kind::wrong_crc);
      case Fault::earlier_answer: return spoil(Kind::earlier_answer);
      case Fault::device_error: return drive_.raise_alarm(0x20, alarm_can_be_reset_);
      case Fault::stalled: return drive_.block(true);
      case Fault::unplugged:
      case Fault::back_after_2s: return server_->vanish();
    }
  }
  void end(Fault) override {
    server_->clear_faults();
    drive_.block(false);
    std::ignore = server_->come_back();
  }
  void send_round() override {
    const std::array<std::uint16_t, 8> move{1, 0x0003, 0x0D40, 135, 100, 100, 0, 0x10};  // 200,000 pulses, 800 deg
    drive_.write(0x6200, move);
  }
  void raise_alarm(bool can_be_reset) override {
    alarm_can_be_reset_ = can_be_reset;
    drive_.raise_alarm(0x20, can_be_reset);
  }
  void power_cycle() override {
    alarm_can_be_reset_ = true;
    drive_.power_cycle();
  }

 private:
  sim::wire::LeadshineDrive drive_;
  bool alarm_can_be_reset_ = true;
  std::unique_ptr<sim::wire::ModbusServer> server_;
  std::unique_ptr<ModbusTurntable> table_;
};

}  // namespace

std::vector<TurntableKind> shipped_turntables(const std::filesystem::path& scratch,
                                              const std::filesystem::path& profiles) {
  std::vector<TurntableKind> kinds;
  const auto leadshine = config::read_drive_profile(profiles / "leadshine-rs.toml").value();
  kinds.push_back({"ModbusTurntable", "leadshine-rs", [scratch, leadshine](Clock& clock) {
                     return std::make_unique<LeadshineEnd>(scratch, leadshine, clock);
                   }});
  return kinds;
}

}  // namespace scanrig::bench
