#include "daemon/station/control_loop.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

namespace scanrig {
namespace {

using testing::ElementsAre;

/// The order in which a loop stops its rig, stores the latch and reports it.
std::vector<std::string> order_after(const Event& event) {
  RealClock clock;
  ControlLoop loop(clock, ControlLoopOptions{}, {});
  std::vector<std::string> order;  // of the first time each happens
  const auto note = [&](const char* what) {
    if (std::ranges::find(order, what) == order.end()) order.emplace_back(what);
  };
  const StationPorts ports{.perform =
                               [&](const Action& action) {
                                 if (!std::holds_alternative<action::StopRig>(action)) return;
                                 note("stop");
                                 loop.post(event::Stopped{});
                               },
                           .show =
                               [&](const PanelOutputs& out) {
                                 if (out.red) note("red lamp");
                               },
                           .store_latch =
                               [&](const auto& latch) {
                                 if (latch) note("stored");
                               },
                           .new_job_id = [] { return std::string("job"); },
                           .published =
                               [&](const auto& snapshot) {
                                 if (snapshot->machine != MachineState::error) return;
                                 note("published");
                                 loop.post(event::Shutdown{});
                               }};
  loop.post(event::PanelFound{true, true});
  loop.post(event);
  EXPECT_TRUE(loop.run(ports));
  return order;
}

TEST(ControlLoopTest, ALatchIsStoredBeforeTheLampOrAnythingElseReportsIt) {
  EXPECT_THAT(order_after(event::EstopChanged{false}), ElementsAre("stop", "stored", "red lamp", "published"));
}

}  // namespace
}  // namespace scanrig
