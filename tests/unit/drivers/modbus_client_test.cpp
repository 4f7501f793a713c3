#include "drivers/modbus/client.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>

#include "sim/wire/modbus_server.h"

namespace scanrig {
namespace {

using sim::wire::WireFault;
using std::chrono::milliseconds;
using testing::HasSubstr;

/// Register n holds n; only registers below 0x4000 exist.
class Counting final : public sim::wire::RegisterDevice {
 public:
  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) override {
    for (auto& value : values) value = address++;
    return address <= 0x4000 ? 0 : 2;
  }
  std::uint8_t write(std::uint16_t, std::span<const std::uint16_t>) override { return 0; }
};

class LineTest : public testing::Test {
 protected:
  RealClock clock_;
  Counting device_;
  const std::string link_ = testing::TempDir() + "line" + std::to_string(::getpid());
  std::unique_ptr<sim::wire::ModbusServer> server_;
  modbus::ClientOptions options_{.device = link_, .reply_timeout = milliseconds(40)};

  void SetUp() override {
    auto server = sim::wire::ModbusServer::start(link_, 1, device_, clock_);
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
  }
  Deadline soon() { return Deadline::after(clock_, milliseconds(1000)); }
  void expect_read(modbus::Client& line, std::uint16_t address) {
    const auto read = line.read(address, 1, soon());
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->front(), address);
  }
  ErrorCode code_of_read(modbus::Client& line, std::uint16_t address) {
    const auto read = line.read(address, 1, soon());
    return read ? ErrorCode::internal : read.error().code;
  }
};

TEST_F(LineTest, ALateAnswerIsNotTakenForTheNextOne) {
  modbus::Client line(options_, clock_);
  expect_read(line, 1);
  server_->inject({WireFault::Kind::late, 1, std::nullopt, milliseconds(80)});
  EXPECT_EQ(code_of_read(line, 2), ErrorCode::timeout);
  EXPECT_TRUE(line.reply_missed());
  for (std::uint16_t address = 3; address < 6; ++address) expect_read(line, address);
  EXPECT_EQ(line.statistics().timeouts, 1u);
  EXPECT_EQ(line.statistics().corrupt, 0u);
}

TEST_F(LineTest, APortThatCannotSwitchTheDirectionIsNamedAtTheFirstRequest) {
  options_.rs485.emplace();
  modbus::Client line(options_, clock_);
  const auto read = line.read(1, 1, soon());
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::unsupported);
  EXPECT_THAT(read.error().message, HasSubstr("open " + link_));
  EXPECT_THAT(read.error().message, HasSubstr("does not switch the direction of RS-485"));
}

TEST_F(LineTest, AnAnswerLaterThanTheQuietLineIsRefusedByItsLength) {
  modbus::Client line(options_, clock_);
  expect_read(line, 1);
  server_->inject({WireFault::Kind::late, 1, std::nullopt, milliseconds(150)});
  EXPECT_EQ(code_of_read(line, 2), ErrorCode::timeout);
  const auto other = line.read(3, 2, soon());
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().code, ErrorCode::io);
  expect_read(line, 4);
}

TEST_F(LineTest, WhoHurriesDoesNotWaitForAQuietLineAndAStopGetsThroughAtOnce) {
  modbus::Client line(options_, clock_);
  expect_read(line, 1);
  server_->inject({WireFault::Kind::reply_lost, 1});
  EXPECT_EQ(code_of_read(line, 2), ErrorCode::timeout);
  line.set_fail_fast(true);
  const auto begun = clock_.now();
  EXPECT_EQ(code_of_read(line, 3), ErrorCode::stopped);
  ASSERT_TRUE(line.write_without_reply(7, 8));
  EXPECT_LT(clock_.now() - begun, options_.reply_timeout) << "a quiet line takes twice as long";
  line.set_fail_fast(false);
  expect_read(line, 4);
  const auto log = server_->log();
  EXPECT_TRUE(std::ranges::any_of(log, [](const auto& frame) {
    return frame.from_master && frame.bytes == sim::wire::with_crc({1, 6, 0, 7, 0, 8});
  }));
}

TEST_F(LineTest, DamagedAndShortAnswersHaveTheirNames) {
  modbus::Client line(options_, clock_);
  server_->inject({WireFault::Kind::wrong_crc, 1});
  EXPECT_EQ(code_of_read(line, 1), ErrorCode::protocol);
  server_->inject({WireFault::Kind::cut_short, 1});
  EXPECT_EQ(code_of_read(line, 2), ErrorCode::timeout);
  expect_read(line, 3);
  EXPECT_EQ(line.statistics().corrupt, 1u);
  EXPECT_EQ(line.statistics().timeouts, 1u);
  EXPECT_EQ(line.statistics().requests, 3u);
}

TEST_F(LineTest, WhatTheDeviceRefusesIsSaidAndLeavesNothingInDoubt) {
  modbus::Client line(options_, clock_);
  const auto read = line.read(0x5000, 1, soon());
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::protocol);
  EXPECT_THAT(read.error().message, HasSubstr("0x5000: the device refused: Illegal data address"));
  EXPECT_FALSE(line.reply_missed());
  EXPECT_EQ(line.statistics().refused, 1u);
}

TEST_F(LineTest, AnAbsentPortIsAnIoErrorUntilItAppears) {
  server_->vanish();
  modbus::Client line(options_, clock_);
  EXPECT_EQ(code_of_read(line, 1), ErrorCode::io);
  ASSERT_TRUE(server_->come_back());
  expect_read(line, 1);
  server_->vanish();
  EXPECT_EQ(code_of_read(line, 1), ErrorCode::io);
  ASSERT_TRUE(server_->come_back());
  expect_read(line, 2);
  EXPECT_EQ(line.statistics().openings, 2u);
}

TEST_F(LineTest, AnExpiredDeadlineSendsNothing) {
  modbus::Client line(options_, clock_);
  expect_read(line, 1);
  server_->clear_log();
  const auto read = line.read(2, 1, Deadline{clock_.now()});
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::timeout);
  EXPECT_TRUE(server_->log().empty());
}

TEST_F(LineTest, AnotherUnitsAnswersAreNotWaitedForLongerThanTheTimeout) {
  options_.unit_id = 2;
  modbus::Client line(options_, clock_);
  EXPECT_EQ(code_of_read(line, 1), ErrorCode::timeout);
}

}  // namespace
}  // namespace scanrig
