// A calibration of other cameras than the rig's: nothing moves for a scan, and the reason is reported.
#include <gmock/gmock.h>

#include <mutex>

#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {
namespace {

using std::chrono::minutes;
using testing::HasSubstr;
using testing::StartsWith;
using What = event::JobRequested::What;

class OtherCameras : public Daemon {
 protected:
  void SetUp() override {
    Daemon::SetUp();
    options.jobs.cameras = {"L1", "R1"};
    options.remote = options.guard = true;
    options.journal = [this](const JournalEntry& entry) {
      const std::lock_guard guard(mutex);
      lines.push_back(entry.message);
    };
  }
  /// A new file in place of the calibration.
  void calibrate(const std::string& left, const std::string& right) const {
    auto text = scan_samples::calibration_json();
    const std::string one = "\"A1\"";
    text.replace(text.find(one), one.size(), '"' + left + '"');
    text.replace(text.find(one), one.size(), '"' + right + '"');
    scan_samples::write_text(folder_ / "new.json", text);
    std::filesystem::rename(folder_ / "new.json", options.jobs.calibration_file);
  }
  bool wait_next_action(const std::string& begin) {
    return clock_waits_for([&] { return loop->snapshot()->next_action.starts_with(begin); });
  }
  std::size_t moves() {
    const std::lock_guard guard(rig.turntable.mutex);
    return rig.turntable.targets.size();
  }
  bool wait_line(const std::string& words) {
    return clock_waits_for([&] {
      const std::lock_guard guard(mutex);
      return std::ranges::any_of(lines, [&](const auto& line) { return line.find(words) != std::string::npos; });
    });
  }
  /// A scan of three views per pose, interrupted by the e-stop after one.
  std::string interrupted() {
    start_until_estop(2);
    const auto id = newest()->id;
    EXPECT_TRUE(wait_state(id, JobState::interrupted));
    return id;
  }
  std::mutex mutex;
  std::vector<std::string> lines;
};

TEST_F(OtherCameras, RefuseAScanUntilTheFileIsReplaced) {
  calibrate("L0", "R0");
  boot();
  get_ready();
  ASSERT_TRUE(wait_next_action("Check the calibration: "));
  const auto before = moves();
  const auto started = ask(Button::start);
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::refused);
  EXPECT_THAT(started.error().message, HasSubstr("L0 (left) and R0 (right), but the rig has L1 and R1"));
  rig.panel.press(&PanelInputs::start);
  clock.sleep_for(minutes(1));
  EXPECT_EQ(moves(), before);
  EXPECT_TRUE(job_folders().empty());
  EXPECT_TRUE(wait_line("No scan with this calibration: "));
  EXPECT_TRUE(wait_line("start is refused: Check the calibration: "));

  calibrate("L1", "R1");
  ASSERT_TRUE(wait_next_action("Put a part on the table"));
  EXPECT_TRUE(wait_line("does not refuse the next scan any more"));
  EXPECT_TRUE(ask(Button::start));
  EXPECT_TRUE(wait_flip());
}

TEST_F(OtherCameras, RefuseAScanWhoseFileIsReplacedAMomentBeforeStart) {
  calibrate("L1", "R1");
  boot();
  get_ready();
  const auto before = moves();
  calibrate("L0", "R0");
  rig.panel.press(&PanelInputs::start);
  clock.sleep_for(minutes(1));
  EXPECT_EQ(moves(), before);
  EXPECT_EQ(loop->snapshot()->machine, MachineState::ready);
  EXPECT_THAT(loop->snapshot()->cause, testing::Not(HasSubstr("was begun with"))) << "it has no views";
  EXPECT_THAT(loop->snapshot()->next_action, StartsWith("Check the calibration: "));
}

TEST_F(OtherCameras, AQueuedJobTakesTheCalibrationThatIsThereWhenItBegins) {
  calibrate("L0", "R0");
  boot();
  get_ready();
  const auto id = ask(JobOrder{.part = "4711"});
  ASSERT_TRUE(id);
  ASSERT_TRUE(wait_next_action("Check the calibration: "));
  EXPECT_FALSE(ask(Button::start));
  calibrate("L1", "R1");
  ASSERT_TRUE(wait_next_action("Put the part for 4711"));
  scan_both_poses();
  ASSERT_TRUE(wait_state(*id, JobState::done));
  const auto calibration = only_job().load_calibration();
  ASSERT_TRUE(calibration);
  EXPECT_EQ(calibration->left.serial, "L1");
  EXPECT_EQ(job(*id)->part, "4711");
}

TEST_F(OtherCameras, HoldTheLine) {
  options.recipes["line"] = {.name = "line", .poses = 1, .views = 3, .start_on_part = true};
  calibrate("L1", "R1");
  boot();
  get_ready();
  ASSERT_TRUE(ask(JobOrder{.recipe = "line", .repeat = 2}));
  const auto ids = loop->snapshot()->queue;
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_state(ids[0], JobState::done));
  calibrate("L0", "R0");
  ASSERT_TRUE(wait_next_action("Check the calibration: "));
  rig.panel.set(&PanelInputs::part_present, false);
  rig.panel.set(&PanelInputs::part_present, true);
  clock.sleep_for(minutes(1));
  EXPECT_EQ(job(ids[1])->state, JobState::queued);
  calibrate("L1", "R1");
  EXPECT_TRUE(wait_state(ids[1], JobState::done));
}

TEST_F(OtherCameras, AJobOfOthersIsNotGoneOnWith) {
  calibrate("L1", "R1");
  boot();
  get_ready();
  const auto id = interrupted();
  shut_down();
  options.jobs.cameras = {"L2", "R2"};
  calibrate("L2", "R2");
  boot();
  get_ready();
  const auto resumed = ask(event::JobRequested{.what = What::resume, .job = id});
  ASSERT_FALSE(resumed);
  EXPECT_EQ(resumed.error().code, ErrorCode::refused);
  EXPECT_THAT(resumed.error().message, HasSubstr("was started with the cameras L1 (left) and R1 (right)"));
  EXPECT_EQ(job(id)->state, JobState::interrupted);
}

TEST_F(OtherCameras, AJobOfOthersThatIsQueuedRefusesStart) {
  calibrate("L1", "R1");
  boot();
  get_ready();
  const auto id = interrupted();
  ASSERT_TRUE(ask(event::JobRequested{.what = What::resume, .job = id}));
  shut_down();
  options.jobs.cameras = {"L2", "R2"};
  calibrate("L2", "R2");
  boot();
  get_ready();
  ASSERT_TRUE(wait_next_action("Check the calibration: job " + id));
  const auto before = moves();
  EXPECT_FALSE(ask(Button::start));
  clock.sleep_for(minutes(1));
  EXPECT_EQ(moves(), before);
  ASSERT_TRUE(ask(event::JobRequested{.what = What::cancel, .job = id}));
  ASSERT_TRUE(wait_next_action("Put a part on the table"));
  EXPECT_TRUE(ask(Button::start));
}

}  // namespace
}  // namespace scanrig
