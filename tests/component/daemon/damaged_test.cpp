#include <gmock/gmock.h>

#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using What = event::JobRequested::What;

/// Jobs whose folders have been damaged when their turn comes.
class Damaged : public Daemon {
 protected:
  void SetUp() override {
    Daemon::SetUp();
    options.recipes["default"].poses = 1;
  }
  /// The ids of two jobs in the queue.
  std::pair<std::string, std::string> order_two() {
    const auto first = ask(JobOrder{.repeat = 2});
    EXPECT_TRUE(first) << first.error().message;
    const auto queue = loop->snapshot()->queue;
    EXPECT_EQ(queue.size(), 2u);
    return {queue.at(0), queue.at(1)};
  }
  void damage(const std::string& id, const std::string& file) {
    scan_samples::write_text(folder_ / "jobs" / id / file, "{ damaged");
  }
  void expect_set_aside(const std::string& id, const std::string& file) {
    EXPECT_TRUE(wait_state(id, JobState::failed)) << to_string(job(id)->state);
    EXPECT_THAT(job(id)->error.value_or(Error{}).message, HasSubstr(file));
  }
};

TEST_F(Damaged, AQueuedJobIsSetAsideWithItsReasonAndTheNextBegins) {
  boot();
  get_ready();
  const auto [first, second] = order_two();
  damage(first, "scan.json");
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(second, JobState::done)) << to_string(job(second)->state);
  expect_set_aside(first, "scan.json");
}

TEST_F(Damaged, AQueuedJobWithoutACalibrationIsNotScannedForNothing) {
  boot();
  get_ready();
  const auto [first, second] = order_two();
  damage(first, "calibration.json");
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(second, JobState::done)) << to_string(job(second)->state);
  expect_set_aside(first, "calibration.json");
  EXPECT_TRUE(job(first)->stored.empty());
  shut_down();
  boot();
  expect_set_aside(first, "calibration.json");
}

TEST_F(Damaged, AQueuedJobWhoseFolderIsGoneIsForgotten) {
  boot();
  get_ready();
  const auto [first, second] = order_two();
  std::error_code not_empty;  // its log is written beside
  for (int i = 0; i < 1000 && fs::exists(folder_ / "jobs" / first); ++i)
    fs::remove_all(folder_ / "jobs" / first, not_empty);
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(second, JobState::done)) << to_string(job(second)->state);
  EXPECT_EQ(job(first), nullptr);
}

TEST_F(Damaged, AResumedJobWithoutTheViewItIsComparedWithIsSetAside) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([&] { return newest() && !newest()->stored.empty(); }));
  const auto id = newest()->id;
  shut_down();
  boot();
  get_ready();
  ASSERT_TRUE(ask(event::JobRequested{.what = What::resume, .job = id}));
  damage(id, "pose1/view00/left_plain.png");
  rig.panel.press(&PanelInputs::start);
  expect_set_aside(id, "left_plain.png");
  EXPECT_TRUE(wait_ready()) << "nothing has moved";
}

}  // namespace
}  // namespace scanrig
