// Stop in every state, by panel, API and command line: never refused, the drive receives it at once, the reply is true.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/client.h"
#include "daemon/ctl/verbs.h"
#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using Task = event::MaintenanceRequested::What;

constexpr milliseconds kWithin{100};

enum class By { panel, api, command_line };

class StopInEveryState;

struct Situation {
  const char* name;
  void (*reach)(StopInEveryState&);
};

class StopInEveryState : public Daemon, public testing::WithParamInterface<std::tuple<Situation, By>> {
 public:
  using Daemon::ask, Daemon::clock_waits_for, Daemon::get_ready, Daemon::loop, Daemon::rig, Daemon::wait_fault,
      Daemon::wait_flip, Daemon::wait_halted;

  void SetUp() override {
    Daemon::SetUp();
    options.guard = true;
    options.recipes["default"].views = 4;
    options.recipes["series"] = {.name = "series", .poses = 1, .views = 2, .start_on_part = true};
  }

  void wait_for(MachineState machine, Activity activity) {
    ASSERT_TRUE(clock_waits_for([&] {
      const auto now = loop->snapshot();
      return now->machine == machine && now->activity == activity;
    })) << to_string(loop->snapshot()->machine)
        << " " << to_string(loop->snapshot()->activity);
  }
  void reach_maintenance() {
    get_ready();
    ASSERT_TRUE(ask(event::MaintenanceRequested{.what = Task::on}));
  }
  void jog() {
    ASSERT_TRUE(ask(event::MaintenanceRequested{.what = Task::jog, .angle = {90}, .speed = {5}}));
    wait_for(MachineState::maintenance, Activity::warning);
  }
  void begin_scan() {
    get_ready();
    rig.panel.press(&PanelInputs::start);
  }

 protected:
  int stops() {
    const std::lock_guard guard(rig.turntable.mutex);
    return rig.turntable.stops;
  }
  /// The reply: the table's standstill at that time; nothing by the panel, which has no reply.
  std::optional<std::string> press_stop(By by) {
    if (by == By::panel) {
      rig.panel.press(&PanelInputs::stop);
      return std::nullopt;
    }
    const Clock::Busy replying(clock);
    if (by == By::command_line) {
      const auto code = ctl::stop({.socket = options.api.socket}, {.wait = false});
      EXPECT_THAT(code, testing::AnyOf(ExitCode::ok, ExitCode::standstill_unknown));
      return std::nullopt;
    }
    const auto reply = ctl::send_request(options.api.socket, "POST", "/api/v1/stop");
    EXPECT_TRUE(reply) << reply.error().message;
    if (!reply) return std::nullopt;
    EXPECT_THAT(reply->at("sent").get<std::string>(), testing::HasSubstr("Stop was sent"));
    return reply->at("standstill").get<std::string>();
  }
};

const Situation kSituations[] = {
    {"halted", [](StopInEveryState& s) { ASSERT_TRUE(s.wait_halted()); }},
    {"warning_before_homing",
     [](StopInEveryState& s) {
       ASSERT_TRUE(s.wait_halted());
       s.rig.panel.press(&PanelInputs::reset);
       s.wait_for(MachineState::initialized, Activity::warning);
     }},
    {"homing",
     [](StopInEveryState& s) {
       ASSERT_TRUE(s.wait_halted());
       s.rig.panel.press(&PanelInputs::reset);
       s.wait_for(MachineState::initialized, Activity::homing);
     }},
    {"ready", [](StopInEveryState& s) { s.get_ready(); }},
    {"warning_before_a_scan",
     [](StopInEveryState& s) {
       s.begin_scan();
       s.wait_for(MachineState::single_execution, Activity::warning);
     }},
    {"scanning",
     [](StopInEveryState& s) {
       s.begin_scan();
       s.wait_for(MachineState::single_execution, Activity::scanning);
     }},
    {"waiting_for_flip",
     [](StopInEveryState& s) {
       s.begin_scan();
       ASSERT_TRUE(s.wait_flip());
     }},
    {"waiting_for_part",
     [](StopInEveryState& s) {
       s.get_ready();
       ASSERT_TRUE(s.ask(JobOrder{.recipe = "series", .repeat = 2}));
       s.rig.panel.press(&PanelInputs::start);
       s.wait_for(MachineState::continuous_execution, Activity::waiting_for_part);
     }},
    {"maintenance", [](StopInEveryState& s) { s.reach_maintenance(); }},
    {"warning_before_a_jog",
     [](StopInEveryState& s) {
       s.reach_maintenance();
       s.jog();
     }},
    {"jogging",
     [](StopInEveryState& s) {
       s.reach_maintenance();
       s.jog();
       s.wait_for(MachineState::maintenance, Activity::jogging);
     }},
    {"fault",
     [](StopInEveryState& s) {
       s.begin_scan();
       s.wait_for(MachineState::single_execution, Activity::scanning);
       s.rig.panel.set(&PanelInputs::estop_ok, false);
       ASSERT_TRUE(s.wait_fault());
     }},
    {"stopped_already",
     [](StopInEveryState& s) {
       s.get_ready();
       s.rig.panel.press(&PanelInputs::stop);
     }},
    {"drive_without_reply",
     [](StopInEveryState& s) {
       s.get_ready();
       {
         const std::lock_guard guard(s.rig.turntable.mutex);
         s.rig.turntable.unreachable = true;
       }
       s.rig.panel.press(&PanelInputs::stop);
       ASSERT_TRUE(s.clock_waits_for([&] { return s.loop->snapshot()->may_be_moving; }));
     }},
};

TEST_P(StopInEveryState, IsObeyed) {
  const auto& [situation, by] = GetParam();
  boot();
  ASSERT_NO_FATAL_FAILURE(situation.reach(*this));
  const auto before = loop->snapshot();
  const int stops_before = stops();
  const auto pressed = clock.now();

  const auto replied = press_stop(by);

  ASSERT_TRUE(clock_waits_for([&] { return stops() > stops_before; })) << "the drive received nothing";
  {
    const std::lock_guard guard(rig.turntable.mutex);
    EXPECT_LE(rig.turntable.last_stop - pressed, kWithin);
  }
  ASSERT_TRUE(clock_waits_for([&] { return loop->snapshot()->activity == Activity::none; }));
  const auto after = loop->snapshot();
  const bool unreachable = std::string_view(situation.name) == "drive_without_reply";
  EXPECT_EQ(standstill(*after), unreachable ? Standstill::unknown : Standstill::confirmed);
  if (replied) {
    EXPECT_THAT(*replied, testing::AnyOf("pending", to_string(standstill(*after))));
  }
  {
    const std::lock_guard guard(rig.turntable.mutex);
    EXPECT_FALSE(rig.turntable.moving);
  }
  if (!before->job.empty()) {
    ASSERT_TRUE(wait_state(before->job, JobState::interrupted));
    EXPECT_TRUE(is_resumable(*job(before->job)));
  }
}

class StopAtRest : public Daemon {};

TEST_F(StopAtRest, LeavesTheNextStartAlone) {
  boot();
  get_ready();
  for (int i = 0; i < 2; ++i) {
    const int before = [&] {
      const std::lock_guard guard(rig.turntable.mutex);
      return rig.turntable.stops;
    }();
    rig.panel.press(&PanelInputs::stop);
    ASSERT_TRUE(clock_waits_for([&] {
      const std::lock_guard guard(rig.turntable.mutex);
      return rig.turntable.stops > before && loop->snapshot()->activity == Activity::none;
    }));
  }
  EXPECT_EQ(loop->snapshot()->machine, MachineState::ready) << "home is kept";
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_flip());
}

std::string name_of(const testing::TestParamInfo<std::tuple<Situation, By>>& info) {
  static constexpr const char* kBy[] = {"panel", "api", "command_line"};
  const auto& [situation, by] = info.param;
  return std::string(situation.name) + "_by_" + kBy[static_cast<int>(by)];
}

INSTANTIATE_TEST_SUITE_P(ByPanelApiAndCommandLine, StopInEveryState,
                         testing::Combine(testing::ValuesIn(kSituations),
                                          testing::Values(By::panel, By::api, By::command_line)),
                         name_of);

}  // namespace
}  // namespace scanrig
