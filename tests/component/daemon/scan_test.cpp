#include <gmock/gmock.h>

#include "daemon/ctl/client.h"
#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(Daemon, MakesOneModelFromTwoPoses) {
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  shut_down();
  EXPECT_TRUE(result) << result.error().message;

  const auto scan = only_job();
  EXPECT_EQ(scan.manifest().state, "scanned");
  ASSERT_EQ(scan.manifest().poses.size(), 2u);
  for (const auto& pose : scan.manifest().poses) {
    EXPECT_TRUE(pose.complete);
    EXPECT_EQ(pose.views.size(), 3u);
  }
  EXPECT_NEAR(scan.manifest().poses[1].views[2].measured_deg, 240.01, 1e-9);
  expect_all_stored_views_readable(scan);
  EXPECT_EQ(*read_file(model_file(scan.path())), "glTF");
  EXPECT_THAT(log.calls, ElementsAre("view 0/0", "view 0/1", "view 0/2", "pose 0", "view 1/0", "view 1/1", "view 1/2",
                                     "pose 1", "finish"));
  for (const auto& [pattern, plain] : log.grey_levels) EXPECT_GT(pattern, plain);
  EXPECT_THAT(rig.turntable.targets, ElementsAre(0, 0, 120, 240, 360, 360, 480, 600, 720));
  EXPECT_FALSE(fs::exists(options.api.socket)) << "the socket goes with the daemon";
}

TEST_F(Daemon, NothingMovesBeforeResetAndTwoSecondsOfWarning) {
  boot();
  ASSERT_TRUE(wait_halted());
  EXPECT_TRUE(rig.turntable.targets.empty());
  const auto pressed = clock.now();
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
  const std::lock_guard guard(rig.turntable.mutex);
  ASSERT_EQ(rig.turntable.move_starts.size(), 1u);
  EXPECT_GE(rig.turntable.move_starts[0] - pressed, seconds(2));
}

TEST_F(Daemon, DoesTwoJobsInARow) {
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  scan_both_poses();
  ASSERT_TRUE(rig.panel.wait_for_lamps([](const auto& l) { return l.busy; }));
  ASSERT_TRUE(wait_ready());
  shut_down();
  EXPECT_EQ(job_folders().size(), 2u);
  for (const auto& folder : job_folders()) EXPECT_TRUE(fs::exists(report_file(folder)));
}

TEST_F(Daemon, LostFramesAreRedoneWithoutAFault) {
  rig.line.lose = 3;
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  EXPECT_EQ(rig.line.exposures, 12 + 4 + 3) << "six views, two movement_checks, three lost";
}

TEST_F(Daemon, WhatIsRedoneInAClosureShotIsTold) {
  rig.line.fires_before = 3 * 2;  // the views of the first pose
  rig.line.at_fire = [this] {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.lose = 2;
  };
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  const auto scan = only_job();
  const auto& movement_check = scan.manifest().poses[0].movement_checks.at(0);
  EXPECT_EQ(movement_check.retake_reasons.size(), 2u);
  EXPECT_EQ(loop->snapshot()->jobs.begin()->second->movement_checks.at(0).retake_reasons.size(), 2u);
  EXPECT_TRUE(scan.manifest().poses[1].movement_checks.at(0).retake_reasons.empty());
}

TEST_F(Daemon, APanelThatHangsStopsTheTableAndIsNamed) {
  options.hang_limit = std::chrono::hours(1);  // it returns
  rig.line.fires_before = 2;
  rig.line.at_fire = [this] { rig.panel.hang(true); };
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  const auto snapshot = [this] { return loop->snapshot(); };
  ASSERT_TRUE(clock_waits_for(
      [&] { return snapshot()->machine == MachineState::error && snapshot()->activity == Activity::none; }));
  EXPECT_THAT(snapshot()->cause, HasSubstr("panel: wait_change has not returned "));
  EXPECT_EQ(snapshot()->fault_device, "panel");
  EXPECT_TRUE(wait_state(newest()->id, JobState::interrupted));
  const auto moves = [this] {
    const std::lock_guard guard(rig.turntable.mutex);
    EXPECT_FALSE(rig.turntable.moving);
    return rig.turntable.targets.size();
  };
  const auto before = moves();
  clock.sleep_for(seconds(20));
  EXPECT_EQ(moves(), before);

  rig.panel.hang(false);
  ASSERT_TRUE(clock_waits_for([&] {
    return !std::ranges::find(snapshot()->devices, "panel", &DeviceHealth::name)->problem;
  })) << "a button that is down when a panel comes back is no press";
  EXPECT_TRUE(wait_fault()) << "the fault stays until the operator resets it";
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
}

TEST_F(Daemon, ACameraThatGoesSilentInterruptsTheJobAndLatches) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.lose = 4;
  }
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_fault());
  rig.panel.press(&PanelInputs::start);
  const auto moves = rig.turntable.targets.size();
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
  EXPECT_EQ(rig.turntable.targets.size(), moves + 1) << "Reset homes, Start did nothing";
  shut_down();
  EXPECT_EQ(only_job().manifest().state, "interrupted");
  EXPECT_EQ(only_job().manifest().poses.at(0).views.size(), 3u);
  EXPECT_THAT(read_failure(only_job().path())->message, HasSubstr("no frame"));
}

TEST_F(Daemon, AnAbsentCameraLeavesTheRestRunningAndIsUsedWhenItComes) {
  rig.line.absent = -1;
  boot();
  get_ready();
  clock.sleep_for(seconds(5));
  rig.panel.press(&PanelInputs::start);
  clock.sleep_for(seconds(60));
  EXPECT_EQ(rig.line.exposures, 0);
  EXPECT_TRUE(job_folders().empty()) << "no job without a camera";
  {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.absent = 0;
  }
  clock.sleep_for(seconds(5));
  scan_both_poses();
  EXPECT_TRUE(wait_pass());
}

TEST_F(Daemon, ACameraPulledInAScanInterruptsTheJobAndIsUsedWhenItIsBack) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.absent = -1;
  }
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_fault());
  {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.absent = 0;
  }
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready());
  EXPECT_EQ(only_job().manifest().state, "interrupted");
  EXPECT_THAT(read_failure(only_job().path())->message, HasSubstr("left camera 4711"));
  clock.sleep_for(seconds(5));  // the next check of the devices
  scan_both_poses();
  EXPECT_TRUE(wait_pass());
}

TEST_F(Daemon, ThePreviewLooksInQuietTimesAndNeverDuringAScan) {
  boot();
  get_ready();
  const auto left = [&] { return ctl::fetch(options.api.socket, "/api/v1/preview/left"); };
  const auto looks = [&] {
    const std::lock_guard guard(rig.line.mutex);
    return rig.line.looks;
  };
  EXPECT_FALSE(left()) << "the first to ask makes the cameras look";
  ASSERT_TRUE(clock_waits_for([&] { return left().has_value(); }));
  EXPECT_GT(looks(), 0);
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  EXPECT_TRUE(clock_waits_for([&] {
    const auto picture = left();
    EXPECT_TRUE(picture) << picture.error().message;
    return rig.panel.lamps().flip_request;
  }));
  const std::lock_guard guard(rig.line.mutex);
  EXPECT_EQ(rig.line.exposures, 2 * (3 + 1)) << "three views and a movement check";
  EXPECT_EQ(rig.line.looks_in_between, 0);
}

TEST_F(Daemon, AStalledTableIsAFaultThatNamesIt) {
  boot();
  ASSERT_TRUE(wait_halted());
  rig.turntable.stalled = true;
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_fault());
  {
    const std::lock_guard guard(rig.turntable.mutex);
    rig.turntable.stalled = false;
  }
  rig.panel.press(&PanelInputs::reset);
  EXPECT_TRUE(wait_ready());
}

TEST_F(Daemon, TheEstopStopsAMovingTableAndNothingResumesByItself) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  rig.panel.set(&PanelInputs::estop_ok, false);
  ASSERT_TRUE(wait_fault());
  rig.panel.set(&PanelInputs::estop_ok, true);
  const auto moves = rig.turntable.targets.size();
  EXPECT_FALSE(rig.turntable.moving);
  rig.panel.press(&PanelInputs::start);
  clock.sleep_for(seconds(60));
  EXPECT_EQ(rig.turntable.targets.size(), moves);
  rig.panel.press(&PanelInputs::reset);
  EXPECT_TRUE(wait_ready());
}

/// The thread of the rig may be at a request to missing cameras when homing is due, and homes next.
TEST_F(Daemon, HomingThatWasStoppedBeforeItBeganDoesNotBegin) {
  boot();
  ASSERT_TRUE(wait_halted());
  for (auto stop_it : {&PanelInputs::stop, &PanelInputs::guard_closed, &PanelInputs::estop_ok}) {
    const auto since = clock.now();
    {
      const std::lock_guard guard(rig.line.mutex);
      rig.line.ready_takes = std::chrono::seconds(3);
    }
    ASSERT_TRUE(clock_waits_for([&] {
      const std::lock_guard guard(rig.line.mutex);
      return rig.line.ready_at > since;
    }));
    rig.panel.press(&PanelInputs::reset);
    clock.sleep_for(std::chrono::milliseconds(2500));  // the warning is over, the cameras have not responded
    EXPECT_EQ(loop->snapshot()->activity, Activity::homing);
    rig.panel.set(stop_it, stop_it == &PanelInputs::stop);
    ASSERT_TRUE(clock_waits_for([&] { return loop->snapshot()->activity == Activity::none; }));
    rig.panel.set(stop_it, stop_it != &PanelInputs::stop);
    clock.sleep_for(std::chrono::seconds(10));
    const std::lock_guard guard(rig.turntable.mutex);
    EXPECT_THAT(rig.turntable.targets, testing::IsEmpty());
  }
}

TEST_F(Daemon, StopInterruptsTheJob) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  rig.panel.press(&PanelInputs::stop);
  ASSERT_TRUE(wait_halted());
  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready()) << "a stop asked for in the past must not end the homing";
  shut_down();
  EXPECT_EQ(only_job().manifest().state, "interrupted");
}

TEST_F(Daemon, AShutdownInTheMiddleOfAScanIsCleanAndKeepsWhatIsStored) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  shut_down();
  EXPECT_TRUE(result) << result.error().message;
  EXPECT_FALSE(rig.turntable.moving);
  EXPECT_FALSE(rig.line.lit);
  const auto scan = only_job();
  EXPECT_EQ(scan.manifest().state, "interrupted");
  EXPECT_GE(scan.manifest().poses.at(0).views.size(), 3u);
  expect_all_stored_views_readable(scan);
}

TEST_F(Daemon, AShutdownWithAnUnreachableTableSaysSo) {
  boot();
  ASSERT_TRUE(wait_halted());
  {
    const std::lock_guard guard(rig.turntable.mutex);
    rig.turntable.unreachable = true;
  }
  shut_down();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::timeout);
  EXPECT_THAT(result.error().message, HasSubstr("may be moving"));
}

/// Under a new configuration another drive may be addressed.
TEST_F(Daemon, AReloadWithAnUnreachableTableEndsTheDaemonInsteadOfForgettingIt) {
  boot();
  get_ready();
  {
    const std::lock_guard guard(rig.turntable.mutex);
    rig.turntable.unreachable = true;
  }
  loop->ask(event::ReloadRequested{}, [](const auto&) {});
  at_the_rig.reset();
  thread.join();
  rig.panel.detach();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::timeout);
  EXPECT_THAT(result.error().message, HasSubstr("may be moving"));
}

TEST_F(Daemon, AFailedReconstructionFailsTheJobAndLeavesNoModel) {
  log.answer_to_finish = fail(ErrorCode::same_rest, "the object was not turned over");
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_fail());
  shut_down();
  EXPECT_FALSE(fs::exists(model_folder(only_job().path())));
  EXPECT_EQ(read_failure(only_job().path())->code, ErrorCode::same_rest);
  EXPECT_EQ(only_job().manifest().state, "scanned") << "the frames are all there";
}

TEST_F(Daemon, AnObjectThatCannotBeReconstructedIsNotTurnedOver) {
  log.answer_to_view = fail(ErrorCode::out_of_range, "the object is larger than the working volume");
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_fail());
  shut_down();
  EXPECT_EQ(only_job().manifest().state, "failed");
  EXPECT_EQ(only_job().manifest().poses.size(), 1u);
}

TEST_F(Daemon, AMissingCalibrationIsNamedAndLeavesNoFolder) {
  boot();
  get_ready();
  fs::remove(options.jobs.calibration_file);
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([&] { return loop->snapshot()->cause.find("calibration.json") != std::string::npos; }));
  EXPECT_EQ(loop->snapshot()->machine, MachineState::ready) << "nothing has moved";
  EXPECT_TRUE(job_folders().empty());
}

TEST_F(Daemon, AnUnpluggedPanelIsAFault) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_busy());
  rig.panel.break_down(true);
  clock.sleep_for(seconds(5));
  rig.panel.break_down(false);
  EXPECT_TRUE(wait_fault());
}

TEST_F(Daemon, ASecondDaemonIsRefused) {
  boot();
  ASSERT_TRUE(wait_halted());
  fakes::FakeRig other(clock);
  const auto second = run_daemon(other.devices(), options, clock, {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::refused);
  auto elsewhere = options;
  elsewhere.jobs.root = folder_ / "other_jobs";
  const auto same_socket = run_daemon(other.devices(), elsewhere, clock, {});
  ASSERT_FALSE(same_socket);
  EXPECT_EQ(same_socket.error().code, ErrorCode::refused);
}

TEST_F(Daemon, TheScannedHookSeesTheWholeScanBeforeAnybodyIsTold) {
  int views_seen = 0;
  options.on_scanned = [&](const fs::path& folder) -> Result<void> {
    const auto scan = ScanFolder::open(folder);
    for (const auto& pose : scan->manifest().poses) views_seen += static_cast<int>(pose.views.size());
    return write_file_atomically(folder / "truth.json", "{}");
  };
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  EXPECT_EQ(views_seen, 6);
}

}  // namespace
}  // namespace scanrig
