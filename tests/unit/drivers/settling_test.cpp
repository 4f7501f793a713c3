#include <gtest/gtest.h>

#include "core/virtual_clock.h"
#include "drivers/turntable/axis_turntable.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;

/// A drive that reaches its target at once, and replies after a while.
class PromptDrive final : public AxisDrive {
 public:
  explicit PromptDrive(Clock& clock) : clock_(clock) {}
  Result<DriveState> read_state(Deadline) override {
    clock_.sleep_for(milliseconds(2));
    return DriveState{.enabled = true, .in_position = true, .homed = homed_, .position = position_};
  }
  Result<std::string> read_alarm(Deadline) override { return std::string(); }
  Result<void> reset_alarm(Deadline) override { return {}; }
  Result<void> check(Deadline) override { return {}; }
  Result<void> enable(Deadline) override { return {}; }
  Result<void> prepare_homing(Deadline) override { return {}; }
  Result<void> start_homing(Deadline) override { return {}; }
  Result<void> set_zero(Deadline) override {
    homed_ = true;
    return {};
  }
  Result<void> set_soft_limits(const MovePlanner::Counter&, Deadline) override { return {}; }
  Result<void> set_speed(DegreesPerSecond) override { return {}; }
  Result<void> start_move(std::int32_t target, Deadline) override {
    position_ = target;
    return {};
  }
  Result<void> stop(Deadline) override { return {}; }
  void stop_without_reply() override {}
  void set_fail_fast(bool) noexcept override {}
  [[nodiscard]] bool reply_missed() const override { return false; }
  void count_retry() override {}

 private:
  Clock& clock_;
  bool homed_ = false;
  std::int32_t position_ = 0;
};

class PromptTable final : public AxisTurntable {
 public:
  PromptTable(const AxisTurntableOptions& options, Clock& clock)
      : AxisTurntable(options, std::make_unique<PromptDrive>(clock), milliseconds(10), {-1e9, 1e9}, clock) {}
};

TEST(Settling, AMoveEndsWithTheSettleTimeAndNotWithAPeriodOfPollingMore) {
  VirtualClock clock;
  for (const int settle_ms : {61, 200, 203}) {
    AxisTurntableOptions options;
    options.home_mode = "here";
    options.settle = milliseconds(settle_ms);
    PromptTable table(options, clock);
    const auto limit = Deadline::after(clock, std::chrono::seconds(10));
    ASSERT_TRUE(table.home(limit));
    const auto move = table.rotate_to({90}, limit);
    ASSERT_TRUE(move) << move.error().message;
    EXPECT_GE(move->settling, milliseconds(settle_ms));
    EXPECT_LE(move->settling, milliseconds(settle_ms + 2)) << "the answer that shows it";
  }
}

}  // namespace
}  // namespace scanrig
