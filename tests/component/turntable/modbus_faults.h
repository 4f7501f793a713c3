#pragma once

#include "tests/component/turntable/modbus_bench.h"
#include "tests/component/turntable/turntable_faults.h"

namespace scanrig {

/// Requirements on every profile; the parameter is the drive.
class ModbusFaults : public testing::TestWithParam<ModbusKind>, protected TurntableFaults {
 protected:
  static constexpr std::uint8_t kRead = 0x03, kWriteOne = 0x06, kWriteSeveral = 0x10;

  static void slow(ModbusTurntableOptions& options) { options.speed = {450}; }

  static bool is_write(const WireFrame& frame, std::uint8_t function, std::uint16_t address) {
    return frame.from_master && frame.bytes[1] == function && frame.bytes[2] == address >> 8 &&
           frame.bytes[3] == (address & 0xFF);
  }
  bool is_move(const WireFrame& frame) const override {
    return is_write(frame, kWriteSeveral, bench_->options().profile.move.address);
  }
  bool is_read(const WireFrame& frame) const override { return frame.from_master && frame.bytes[1] == kRead; }
  bool is_stop(const WireFrame& frame) const override {
    const auto& stop = bench_->options().profile.stop;
    return is_write(frame, kWriteOne, stop.address) && frame.bytes[4] == 0 && frame.bytes[5] == stop.value;
  }
  std::uint8_t moving() const override { return kWriteSeveral; }
  std::uint8_t reading() const override { return kRead; }
  WireBench& bench() override { return *bench_; }

  void start(const ModbusBench::Change& change) {
    bench_.reset();
    bench_ = std::make_unique<ModbusBench>(GetParam(), change);
  }
  void start_at_zero(const ModbusBench::Change& change = [](auto&) {}) {
    start(change);
    go_to_zero();
  }

  std::unique_ptr<ModbusBench> bench_ = std::make_unique<ModbusBench>(GetParam());
};

inline std::string drive_name(const testing::TestParamInfo<ModbusKind>& kind) {
  return kind.param.profile == kOriental.profile ? "Oriental" : "Leadshine";
}

}  // namespace scanrig
