#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/bench/turns/go_round.h"

// A hundred turns from home and at either end of what the drive can count. The bench makes ten thousand.

namespace scanrig::bench {
namespace {

struct Drive {
  const char* name;
  int wound_up;  ///< turns from home, two before its counter is full
};

class Turns : public testing::TestWithParam<Drive> {
 protected:
  void expect_no_drift(int preload_turns, bool up) {
    const auto port = testing::TempDir() + "turns" + GetParam().name + std::to_string(::getpid());
    const auto seen = go_round(GetParam().name, SCANRIG_SOURCE_DIR "/config/drives", port, 100, preload_turns, up);
    EXPECT_EQ(seen.error, "");
    EXPECT_EQ(seen.turns, 100);
    EXPECT_LE(seen.drift_deg, 0.01);
    EXPECT_LE(seen.worst_angle_deg, 0.01);
    EXPECT_LE(seen.longest_way_deg, 361.0);
  }
};

TEST_P(Turns, FromHome) { expect_no_drift(0, true); }
TEST_P(Turns, AtTheUpperEndOfTheCounter) { expect_no_drift(GetParam().wound_up, true); }
TEST_P(Turns, AtTheLowerEndOfTheCounter) { expect_no_drift(-GetParam().wound_up, false); }

// 32 bits of pulses, 900,000 a turn; GRBL reports 32 bits of thousandths of a motor degree, 32,400,000 a turn.
INSTANTIATE_TEST_SUITE_P(All, Turns,
                         testing::Values(Drive{"leadshine-rs", 2384}, Drive{"oriental-az", 2384}, Drive{"grbl", 64}),
                         [](const auto& drive) {
                           std::string name = drive.param.name;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace scanrig::bench
