// Messages of the daemon to systemd, received on the socket that systemd would use.
#include "daemon/service/systemd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/virtual_clock.h"
#include "daemon/station/control_loop.h"
#include "tests/system/service/notify_listener.h"

namespace scanrig {
namespace {

using ::testing::HasSubstr;

TEST(ServiceManager, IsToldOnceThatTheServiceIsReadyAndEveryTimeThatItLives) {
  Listener systemd;
  ServiceManager manager;
  manager.alive("Press Reset.");
  manager.alive("Press Reset.");
  const auto heard = systemd.heard();
  ASSERT_EQ(heard.size(), 2u);
  EXPECT_EQ(heard[0], "WATCHDOG=1\nREADY=1\nSTATUS=Press Reset.");
  EXPECT_EQ(heard[1], "WATCHDOG=1");
}

TEST(ServiceManager, IsToldWhatTheServiceDoesWhenThatChanges) {
  Listener systemd;
  ServiceManager manager;
  manager.alive("Press Reset.");
  manager.alive("The table is homing.");
  EXPECT_THAT(systemd.heard().back(), HasSubstr("STATUS=The table is homing."));
}

TEST(ServiceManager, IsToldThatTheServiceEndsOnlyIfItEverBegan) {
  Listener systemd;
  { ServiceManager never; }
  EXPECT_TRUE(systemd.heard().empty());
  {
    ServiceManager manager;
    manager.alive("");
  }
  EXPECT_EQ(systemd.heard().back(), "STOPPING=1");
}

TEST(ServiceManager, IsToldOfAReloadAndOfReadinessOnlyWhenTheDaemonHasBegunAgain) {
  Listener systemd;
  ServiceManager manager;
  manager.alive("The rig is ready.");
  manager.reloading();
  manager.alive("Reloading the configuration.");
  manager.begins_again();
  manager.alive("The table is not homed.");
  const auto heard = systemd.heard();
  ASSERT_EQ(heard.size(), 5u);
  EXPECT_THAT(heard[1], testing::MatchesRegex("RELOADING=1\nMONOTONIC_USEC=[0-9]+\nSTATUS=.*"));
  EXPECT_EQ(heard[2], "WATCHDOG=1") << "it lives, but is not ready";
  EXPECT_EQ(heard[3], "WATCHDOG=1");
  EXPECT_EQ(heard[4], "WATCHDOG=1\nREADY=1\nSTATUS=The table is not homed.");
}

TEST(ServiceManager, IsToldWhyAReloadChangedNothing) {
  Listener systemd;
  ServiceManager manager;
  manager.alive("Scanning.");
  manager.reloading();
  manager.stays("The configuration stays.");
  manager.alive("Scanning.");
  const auto heard = systemd.heard();
  ASSERT_EQ(heard.size(), 4u);
  EXPECT_EQ(heard[2], "READY=1\nSTATUS=The configuration stays.");
  EXPECT_EQ(heard[3], "WATCHDOG=1") << "the reason stays to be read";
}

TEST(ServiceManager, AnIdleControlLoopSaysEverySecondThatItLives) {
  VirtualClock clock;
  ControlLoop loop(clock, {}, {});
  int signs = 0;
  const Clock::Actor actor(clock);
  const auto begin = clock.now();
  const StationPorts ports{.alive =
                               [&] {
                                 if (++signs == 60) loop.post(event::Shutdown{});
                               },
                           .perform = [](const Action&) {},
                           .show = [](const PanelOutputs&) {},
                           .new_job_id = [] { return std::string(); }};
  std::ignore = loop.run(ports);
  EXPECT_LE(clock.now() - begin, std::chrono::seconds(60 + 5));  // 5 s to be seen stopped
}

}  // namespace
}  // namespace scanrig
