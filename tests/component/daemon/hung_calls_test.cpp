// A driver's call that does not return, in each call of each interface: it is named within a second after its deadline.
// The table is stopped past it, and a daemon whose device does not come back ends.
#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <functional>

#include "daemon/ctl/client.h"
#include "sim/devices/sim_rig.h"
#include "tests/component/daemon/daemon_under_test.h"
#include "tests/component/daemon/hanging_devices.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::StartsWith;
using Task = event::MaintenanceRequested::What;

/// The fake rig with the simulator's turntable, which reports its true state; each call can be made to hang.
class HungCalls : public Daemon {
 protected:
  void SetUp() override {
    Daemon::SetUp();
    auto made = sim::SimRig::create({.object = {}, .image_scale = 0.1}, clock);
    ASSERT_TRUE(made) << made.error().message;
    sim = std::move(*made);
    turntable.emplace(sim->turntable(), gate, clock);
    options.recipes["default"].views = 2;  // half a turn takes four seconds
    options.stop_table_outside = [this] {
      outside_stops++;
      return sim->turntable().stop(Deadline::after(clock, seconds(3)));
    };
    options.on_exit_hang = [this](const Error& why) {
      given_up = why.message;
      given_up_at = clock.now();
      gate.release();  // instead of the end of the process
    };
  }
  void TearDown() override {
    gate.release();
    Daemon::TearDown();
  }
  Devices devices() override { return {*turntable, projector, camera, panel}; }

  bool table_moves() {
    const auto status = sim->turntable().status({clock.now()});
    return status->motion != TurntableStatus::Motion::stopped;
  }
  std::shared_ptr<const Snapshot> now() const { return loop->snapshot(); }
  bool wait_hung() {
    return clock_waits_for([this] { return gate.deadline().has_value(); });
  }
  void start_and_wait_moving() {
    rig.panel.press(&PanelInputs::start);
    ASSERT_TRUE(clock_waits_for([this] { return sim->turntable().status({clock.now()})->angle->value < -20; }));
    ASSERT_TRUE(table_moves());
  }

  // Steps that lead to each call; the last one of them hangs.

  void while_homing(const std::string& call) {
    ASSERT_TRUE(wait_halted());
    gate.close(call);
    rig.panel.press(&PanelInputs::reset);
  }
  void while_idle(const std::string& call) {
    get_ready();
    gate.close(call);
  }
  void while_exposing(const std::string& call) {
    get_ready();
    rig.panel.press(&PanelInputs::start);
    gate.close(call);
  }
  /// Collect of the second view: the first is at home. `move_limit` is less than it takes: the table turns at the hang.
  void while_turning(const std::string& call) {
    get_ready();
    {
      const std::lock_guard guard(rig.line.mutex);
      rig.line.at_fire = [this, call] { gate.close(call); };
    }
    rig.panel.press(&PanelInputs::start);
  }
  void by_stop(const std::string& call) {
    get_ready();
    start_and_wait_moving();
    gate.close(call);
    EXPECT_TRUE(ask(Button::stop));
  }
  void while_moving(const std::string& call) {
    get_ready();
    start_and_wait_moving();
    gate.close(call);
  }
  void by_preview(const std::string& call) {
    get_ready();
    gate.close(call);
    std::ignore = ctl::fetch(options.api.socket, "/api/v1/preview/left");
  }
  void by_jog(const std::string& call) {
    get_ready();
    ASSERT_TRUE(ask(event::MaintenanceRequested{.what = Task::on}));
    const auto does_nothing = [this] { return now()->activity == Activity::none; };
    ASSERT_TRUE(clock_waits_for(does_nothing));
    rig.panel.press(&PanelInputs::reset);  // consents to it, and homes
    ASSERT_TRUE(clock_waits_for(std::not_fn(does_nothing)));
    ASSERT_TRUE(clock_waits_for(does_nothing));
    gate.close(call);
    const auto jogged = ask(event::MaintenanceRequested{.what = Task::jog, .angle = {20}, .speed = {5}});
    ASSERT_TRUE(jogged) << jogged.error().message;
  }

  bool is_named(const std::string& text) const {
    if (now()->machine != MachineState::error) return false;
    if (now()->cause.starts_with(text)) return true;
    return std::ranges::any_of(now()->devices, [&](const DeviceHealth& device) {
      return device.problem && device.problem->message.starts_with(text);
    });
  }

  fakes::Gate gate{clock};
  std::unique_ptr<sim::SimRig> sim;
  std::optional<fakes::HangingTurntable> turntable;
  fakes::HangingProjector projector{rig.projector, gate};
  fakes::HangingCamera camera{rig.camera, gate};
  fakes::HangingPanel panel{rig.panel, gate};
  std::atomic<int> outside_stops = 0;
  std::string given_up;
  Clock::TimePoint given_up_at{};
};

class EachHungCall : public HungCalls, public testing::WithParamInterface<std::pair<const char*, const char*>> {
 protected:
  void provoke(const std::string& call) {
    const std::map<std::string, void (EachHungCall::*)(const std::string&)> ways{
        {"turntable.home", &EachHungCall::while_homing},       {"turntable.reset_alarm", &EachHungCall::while_homing},
        {"turntable.rotate_to", &EachHungCall::while_turning}, {"turntable.stop", &EachHungCall::by_stop},
        {"turntable.status", &EachHungCall::while_idle},       {"turntable.limit_speed", &EachHungCall::by_jog},
        {"projector.fire", &EachHungCall::while_exposing},     {"projector.turn_off", &EachHungCall::by_stop},
        {"camera.prepare", &EachHungCall::while_idle},         {"camera.arm", &EachHungCall::while_exposing},
        {"camera.collect", &EachHungCall::while_exposing},     {"camera.capture_preview", &EachHungCall::by_preview},
        {"panel.wait_change", &EachHungCall::while_moving},    {"panel.show", &EachHungCall::by_stop}};
    (this->*ways.at(call))(call);
  }
};

TEST_P(EachHungCall, IsNamedWithinASecondTheTableStopsAndTheDaemonEnds) {
  const auto [device, call] = GetParam();
  if (std::string(call) == "rotate_to") options.acquisition.move_limit = seconds(2);
  boot();
  provoke(fmt::format("{}.{}", device, call));
  ASSERT_TRUE(wait_hung());
  const auto deadline = gate.deadline()->at;
  const auto text = fmt::format("{}: {} has not returned", device, call);
  clock.sleep_until(deadline);
  EXPECT_FALSE(is_named(text));
  ASSERT_TRUE(clock_waits_for([&] { return is_named(text); })) << now()->cause;
  EXPECT_LE(clock.now() - deadline, seconds(1));

  ASSERT_TRUE(clock_waits_for([&] { return now()->activity == Activity::none; })) << now()->cause;
  EXPECT_FALSE(now()->may_be_moving);
  EXPECT_FALSE(table_moves());
  EXPECT_EQ(now()->machine, MachineState::error) << "latched";
  EXPECT_EQ(outside_stops > 0, std::string(device) == "turntable");
  if (std::string(device) != "panel") {
    rig.panel.press(&PanelInputs::reset);
    EXPECT_EQ(now()->machine, MachineState::error) << "Reset while it hangs moves nothing";
  }

  at_the_rig.reset();
  thread.join();
  EXPECT_THAT(given_up, StartsWith(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(exit_code(result.error().code), ExitCode::device);
  EXPECT_LE(given_up_at - deadline, seconds(11));
  EXPECT_FALSE(table_moves());
}

INSTANTIATE_TEST_SUITE_P(AllCalls, EachHungCall,
                         testing::Values(std::pair("turntable", "home"), std::pair("turntable", "rotate_to"),
                                         std::pair("turntable", "stop"), std::pair("turntable", "reset_alarm"),
                                         std::pair("turntable", "status"), std::pair("turntable", "limit_speed"),
                                         std::pair("projector", "fire"), std::pair("projector", "turn_off"),
                                         std::pair("camera", "prepare"), std::pair("camera", "arm"),
                                         std::pair("camera", "collect"), std::pair("camera", "capture_preview"),
                                         std::pair("panel", "wait_change"), std::pair("panel", "show")),
                         [](const auto& each) { return std::string(each.param.first) + "_" + each.param.second; });

TEST_F(HungCalls, ATableThatTurnsBehindACallThatHangsIsStoppedByAnotherProcess) {
  options.acquisition.move_limit = seconds(2);
  boot();
  while_turning("turntable.rotate_to");
  ASSERT_TRUE(wait_hung());
  const auto deadline = gate.deadline()->at;
  clock.sleep_until(deadline);
  EXPECT_TRUE(table_moves()) << "or the test shows nothing";
  ASSERT_TRUE(clock_waits_for([this] { return outside_stops > 0; }));
  EXPECT_LE(clock.now() - deadline, seconds(1));
  ASSERT_TRUE(clock_waits_for([&] { return now()->activity == Activity::none; }));
  EXPECT_FALSE(table_moves());
}

TEST_F(HungCalls, WhereNoOtherProcessReachesTheDriveTheDaemonEndsAtOnce) {
  options.stop_table_outside = [] { return Result<void>(fail(ErrorCode::io, "turntable: the port is in use")); };
  boot();
  while_turning("turntable.rotate_to");
  ASSERT_TRUE(wait_hung());
  const auto deadline = gate.deadline()->at;
  at_the_rig.reset();
  thread.join();
  EXPECT_THAT(given_up, HasSubstr("rotate_to"));
  EXPECT_LE(given_up_at - deadline, seconds(2));
  EXPECT_FALSE(result);
}

TEST_F(HungCalls, ACallThatReturnsInTimeLeavesTheDaemonRunningAndTheFaultLatched) {
  boot();
  while_exposing("camera.collect");
  ASSERT_TRUE(clock_waits_for([&] { return is_named("camera: collect has not returned"); }));
  clock.sleep_for(seconds(5));
  gate.release();
  ASSERT_TRUE(clock_waits_for([&] { return now()->activity == Activity::none; }));
  clock.sleep_for(seconds(20));
  EXPECT_EQ(now()->machine, MachineState::error);
  EXPECT_EQ(now()->fault_device, "camera");
  EXPECT_FALSE(is_named("camera: collect has not returned") && !now()->cause.starts_with("camera"));
  rig.panel.press(&PanelInputs::reset);
  EXPECT_TRUE(wait_ready());
  EXPECT_EQ(given_up, "");
}

}  // namespace
}  // namespace scanrig
