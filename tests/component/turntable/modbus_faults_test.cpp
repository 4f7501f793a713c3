#include "tests/component/turntable/modbus_faults.h"

// The wire misbehaves.

namespace scanrig {
namespace {

using testing::HasSubstr;

TEST_P(ModbusFaults, SpoiledAnswersEndInTheirErrorWithinTheDeadlineWithTheTableAtRest) {
  constexpr auto forever = -1;
  const std::vector<Spoiled> all{
      {"Silent", {WireFault::Kind::request_lost, forever}, ErrorCode::timeout, false},
      {"AnswersLost", {WireFault::Kind::reply_lost, forever, kRead}, ErrorCode::timeout, true},
      {"Late", {WireFault::Kind::late, forever, kRead, milliseconds(50)}, ErrorCode::timeout, true},
      {"WrongCrc", {WireFault::Kind::wrong_crc, forever, kRead}, ErrorCode::protocol, true},
      {"CutShort", {WireFault::Kind::cut_short, forever, kRead}, ErrorCode::timeout, true},
      {"Refused", {WireFault::Kind::refuse, forever, kRead, {}, 4}, ErrorCode::protocol, true},
      {"EarlierAnswers", {WireFault::Kind::earlier_reply, forever, kRead}, ErrorCode::protocol, true}};
  for (const Spoiled& spoiled : all) {
    SCOPED_TRACE(spoiled.name);
    start_at_zero(slow);
    // From the next move on, after the drive has received it.
    bench_->on_request([&](const sim::wire::ModbusRequest& request) {
      if (request.address == bench_->options().profile.move.address) bench_->server().inject(spoiled.fault);
    });
    expect_named_end(spoiled);
    bench_->on_request({});
    expect_home_is_needed_and_helps();
  }
}

TEST_P(ModbusFaults, OneDamagedAnswerIsAskedForAgainAndCounted) {
  start_at_zero();
  expect_one_damaged_answer_asked_for_again();
}

TEST_P(ModbusFaults, AMoveWhoseAnswerIsLostIsNotSentAgainOnceSeenRunning) {
  start_at_zero(slow);
  expect_move_not_sent_again_once_seen_running();
}

TEST_P(ModbusFaults, AMoveThatWasNotHeardIsSentAgainOnlyAfterReading) {
  start_at_zero();
  expect_move_sent_again_only_after_reading();
}

TEST_P(ModbusFaults, APulledAdapterIsAnIoErrorAndTheDriveHearsStopFirstWhenItIsBack) {
  start_at_zero(slow);
  expect_stop_first_after_a_pulled_adapter();
  expect_home_is_needed_and_helps();
}

TEST_P(ModbusFaults, TwoMastersCannotShareALine) {
  start_at_zero();
  modbus::ClientOptions options;
  options.device = bench_->device();
  modbus::Client second(options, bench_->clock());
  const auto read = second.read(0x1003, 1, within(milliseconds(500)));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::io);
  EXPECT_THAT(read.error().message, HasSubstr("another program"));
}

TEST_P(ModbusFaults, StopIsNotClaimedWithoutAnAnswer) {
  start_at_zero();
  bench_->server().inject({WireFault::Kind::request_lost});
  const auto stopped = bench_->turntable().stop(within(milliseconds(600)));
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::timeout);
  EXPECT_THAT(stopped.error().message, HasSubstr("may be moving"));
}

INSTANTIATE_TEST_SUITE_P(Modbus, ModbusFaults, testing::Values(kLeadshine, kOriental), drive_name);

}  // namespace
}  // namespace scanrig
