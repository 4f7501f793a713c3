#include <map>
#include <sstream>

#include "tests/component/camera/aravis_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;

/// Checks by the hidden number: a returned frame belongs to this trigger, in both images.
TEST(AravisFaults, OfAThousandTriggersWithLossesNoneGivesAMismatchedOrOlderPair) {
  AravisBench bench([](AravisOptions& options) { options.frame_timeout = milliseconds(100); }, 150);
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  ASSERT_EQ(bench.far().tell("rates 0.01 0.01 0.01 0.005 7"), "ok");
  int good = 0, wrong = 0;
  std::map<ErrorCode, int> named;
  while (good < 1000) {
    const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(5));
    const auto armed = bench.camera().arm(deadline);
    ASSERT_TRUE(armed) << armed.error().message;
    const auto number = bench.fire();
    const auto frame = bench.camera().collect(deadline);
    if (!frame) {
      EXPECT_FALSE(frame.error().message.empty());
      ++named[frame.error().code];
      continue;
    }
    ++good;
    wrong += bench.number_in(frame->left) != number || bench.number_in(frame->right) != number;
  }
  EXPECT_EQ(wrong, 0);
  std::istringstream counts(bench.far().tell("counts"));
  int lost = 0, late = 0, torn = 0, stale = 0;
  counts >> lost >> late >> torn >> stale;
  EXPECT_GT(lost * late * torn * stale, 0);
  // At least as many: on a busy machine a frame can be late on its own, and mask the fault of the other sensor's frame.
  EXPECT_GE(named[ErrorCode::timeout] + named[ErrorCode::protocol], lost + late + torn + stale);
  const TriggerCounts& seen = bench.camera().counts();
  EXPECT_GT(seen.torn, 0u);
  EXPECT_GT(seen.old, 0u);
  EXPECT_EQ(static_cast<std::uint64_t>(named[ErrorCode::timeout]), seen.lost);
  EXPECT_EQ(static_cast<std::uint64_t>(named[ErrorCode::protocol]), seen.torn + seen.old + seen.odd);
}

}  // namespace
}  // namespace scanrig
