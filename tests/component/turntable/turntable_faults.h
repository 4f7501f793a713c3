#pragma once

#include <gmock/gmock.h>

#include <algorithm>

#include "tests/component/turntable/wire_bench.h"

namespace scanrig {

/// Requirements on every drive on a wire when the wire or the drive misbehaves; a test fixture adds the drive.
class TurntableFaults {
 protected:
  using milliseconds = std::chrono::milliseconds;
  using WireFault = sim::wire::WireFault;
  using WireFrame = sim::wire::WireFrame;

  /// Replies damaged during a move, and the required end of the move.
  struct Spoiled {
    const char* name;
    WireFault fault;
    ErrorCode code;
    bool hears_stop;
  };

  virtual ~TurntableFaults() = default;
  virtual WireBench& bench() = 0;
  // Messages on the wire.
  virtual bool is_move(const WireFrame& frame) const = 0;
  virtual bool is_read(const WireFrame& frame) const = 0;
  virtual bool is_stop(const WireFrame& frame) const = 0;
  // The far end's name for it; see WireFault::function.
  virtual std::uint8_t moving() const = 0;
  virtual std::uint8_t reading() const = 0;

  Deadline within(milliseconds time) { return Deadline::after(bench().clock(), time); }
  Result<void> home() { return bench().turntable().home(within(milliseconds(5000))); }
  Result<Move> rotate_to(double deg) { return bench().turntable().rotate_to(Degrees{deg}, within(milliseconds(3000))); }
  Result<TurntableStatus> status() { return bench().turntable().status(within(milliseconds(1000))); }
  Result<void> reset_alarm() { return bench().turntable().reset_alarm(within(milliseconds(1000))); }

  auto moves_sent() {
    const auto log = bench().server().log();
    return std::ranges::count_if(log, [this](const auto& frame) { return is_move(frame); });
  }
  void go_to_zero() {
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(0);
    ASSERT_TRUE(moved) << moved.error().message;
    bench().server().clear_log();
  }

  void expect_rest(double by_deg) {
    for (const auto by = within(milliseconds(2000)); bench().seen_moving() && !by.expired(bench().clock());) {
      bench().clock().sleep_for(milliseconds(2));
    }
    EXPECT_FALSE(bench().seen_moving());
    EXPECT_LT(bench().seen_deg(), by_deg);
  }
  void expect_home_is_needed_and_helps() {
    const auto refused = rotate_to(10);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::not_homed) << refused.error().message;
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(10);
    ASSERT_TRUE(moved) << moved.error().message;
  }

  /// From zero, at a speed that leaves time to act: each of these may be called in a test of its own.
  void expect_named_end(const Spoiled& spoiled);
  void expect_one_damaged_answer_asked_for_again();
  void expect_move_not_sent_again_once_seen_running();
  void expect_move_sent_again_only_after_reading();
  void expect_stop_first_after_a_pulled_adapter();
  void expect_alarm_until_reset(std::uint16_t alarm, const char* words);
};

inline void TurntableFaults::expect_named_end(const Spoiled& spoiled) {
  const auto began = bench().clock().now();
  const auto moved = rotate_to(175);
  EXPECT_LT(bench().clock().now() - began, milliseconds(3000));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, spoiled.code) << moved.error().message;
  EXPECT_THAT(moved.error().message, testing::HasSubstr(spoiled.hears_stop ? "told to stop" : "may be moving"));
  bench().server().clear_faults();
  if (!spoiled.hears_stop) {
    // The first request that the drive receives when it listens again.
    bench().server().clear_log();
    EXPECT_TRUE(bench().turntable().status(within(milliseconds(2000))));
    ASSERT_FALSE(bench().server().log().empty());
    EXPECT_TRUE(is_stop(bench().server().log().front()));
  }
  expect_rest(spoiled.hears_stop ? 174.0 : 176.0);
}

inline void TurntableFaults::expect_one_damaged_answer_asked_for_again() {
  const auto before = bench().counted();
  bench().server().inject({WireFault::Kind::wrong_crc, 1, reading()});
  ASSERT_TRUE(rotate_to(45));
  EXPECT_EQ(bench().counted().corrupt - before.corrupt, 1u);
  EXPECT_GE(bench().counted().retries - before.retries, 1u);
}

inline void TurntableFaults::expect_move_not_sent_again_once_seen_running() {
  bench().server().inject({WireFault::Kind::reply_lost, 1, moving()});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(moved->measured.value, 45, 0.05);
  EXPECT_EQ(moves_sent(), 1);
}

inline void TurntableFaults::expect_move_sent_again_only_after_reading() {
  const auto before = bench().counted();
  bench().server().inject({WireFault::Kind::request_lost, 1, moving()});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  ASSERT_EQ(moves_sent(), 2);
  const auto log = bench().server().log();
  const auto move = [this](const auto& frame) { return is_move(frame); };
  const auto first = std::ranges::find_if(log, move);
  const auto second = std::find_if(first + 1, log.end(), move);
  EXPECT_TRUE(std::any_of(first, second, [this](const auto& frame) { return is_read(frame); }));
  EXPECT_GE(bench().counted().retries - before.retries, 1u);
}

inline void TurntableFaults::expect_stop_first_after_a_pulled_adapter() {
  bench().when_moving([&] { bench().server().vanish(); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::io) << moved.error().message;
  EXPECT_THAT(moved.error().message, testing::HasSubstr("may be moving"));
  const auto gone = status();
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, ErrorCode::io);

  bench().server().clear_log();
  ASSERT_TRUE(bench().server().come_back());
  const auto back = status();
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_FALSE(back->homed);
  EXPECT_TRUE(is_stop(bench().server().log().front()));
  expect_rest(180.0);
}

inline void TurntableFaults::expect_alarm_until_reset(std::uint16_t alarm, const char* words) {
  bench().when_moving([&] { bench().drive().raise_alarm(alarm); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device_alarm) << moved.error().message;
  EXPECT_THAT(moved.error().message, testing::HasSubstr(words));
  expect_rest(89.0);
  const auto seen = status();
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_THAT(seen->alarm, testing::HasSubstr(words));
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::device_alarm);
  ASSERT_TRUE(reset_alarm());
}

}  // namespace scanrig
