#include <gmock/gmock.h>

#include "daemon/rig/make_safe.h"
#include "daemon/rig/open_devices.h"
#include "tests/component/safety/wire_rig.h"

namespace scanrig {
namespace {

/// A daemon that hangs still has the turntable's port: the process that makes the rig safe beside it sends the stop.
TEST(SharedPort, TheStopReachesADriveWhosePortAHungDaemonHas) {
  WireRig rig({});
  const auto config = config::read_rig_config(rig.config());
  ASSERT_TRUE(config) << config.error().message;
  const auto turntable = open_turntable(config->turntable, rig.clock);
  ASSERT_TRUE(turntable);
  ASSERT_TRUE((*turntable)->status(Deadline::after(rig.clock, WireRig::kReplyTimeout)))
      << "from here on the port is taken";

  const auto before = rig.clock.now();
  EXPECT_EQ(make_safe_now(rig.config(), "test"), ExitCode::device);
  EXPECT_TRUE(rig.stops(before).empty());
  EXPECT_EQ(make_safe_now(rig.config(), "test", Beside::hung_daemon), ExitCode::ok);
  EXPECT_FALSE(rig.stops(before).empty());
}

}  // namespace
}  // namespace scanrig
