#include <gmock/gmock.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "tests/component/daemon/daemon_under_test.h"
#include "tests/component/daemon/fake_disk.h"

namespace scanrig {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using What = event::JobAsked::What;

/// A whole daemon on a disk that fails or hangs.
class BadDisk : public Daemon {
 protected:
  void TearDown() override {
    fakes::disk().at_sync({});
    Daemon::TearDown();
  }
  int exposures() {
    const std::lock_guard guard(rig.line.mutex);
    return rig.line.exposures;
  }
  Result<std::string> resume(const std::string& id) { return ask(event::JobAsked{.what = What::resume, .job = id}); }
  static std::vector<int> views_of(const PoseRecord& pose) {
    std::vector<int> indices;
    for (const auto& view : pose.views) indices.push_back(view.index);
    return indices;
  }
};

TEST_F(BadDisk, AViewItDidNotTakeOnceIsTakenAgainWithWhatCameAfterIt) {
  for (const int error : {ENOSPC, EIO}) {
    std::filesystem::remove_all(folder_ / "jobs");
    std::atomic<bool> failed = false;
    // The view after it is taken, and waits to be stored, before the disk fails.
    fakes::disk().at_sync([&, until = exposures() + 6](const std::string& path) {
      if (path.find("/pose1/view01/") == std::string::npos || failed.exchange(true)) return 0;
      EXPECT_TRUE(clock_waits_for([&] { return exposures() >= until; }));
      clock.sleep_for(seconds(5));
      return error;
    });
    boot();
    get_ready();
    rig.panel.press(&PanelInputs::start);
    ASSERT_TRUE(wait_halted());
    const auto id = newest()->id;
    ASSERT_TRUE(wait_state(id, JobState::interrupted));
    EXPECT_THAT(job(id)->error->message, HasSubstr(std::strerror(error)));
    EXPECT_THAT(views_of(only_job().manifest().poses[0]), ElementsAre(0));

    ASSERT_TRUE(resume(id));
    rig.panel.press(&PanelInputs::reset);
    ASSERT_TRUE(wait_ready());
    scan_both_poses();
    EXPECT_TRUE(wait_state(id, JobState::done));
    const auto scan = only_job();
    for (const auto& pose : scan.manifest().poses) EXPECT_THAT(views_of(pose), ElementsAre(0, 1, 2));
    expect_all_stored_views_readable(scan);
    shut_down();
  }
}

TEST_F(BadDisk, TakingNothingAtTheStartItLeavesAJobToBeResumed) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  const auto id = newest()->id;
  shut_down();
  const auto as_if_killed = ScanFolder::open(job_folders().at(0))->set_state("waiting_for_flip");
  ASSERT_TRUE(as_if_killed) << as_if_killed.error().message;

  fakes::disk().at_sync([](const std::string&) { return EROFS; });
  boot();
  get_ready();
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  EXPECT_TRUE(job(id)->resumable);
  const auto refused = resume(id);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr(std::strerror(EROFS)));
  EXPECT_EQ(job(id)->state, JobState::interrupted);

  fakes::disk().at_sync({});
  const auto resumed = resume(id);
  ASSERT_TRUE(resumed) << resumed.error().message;
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(id, JobState::done));
}

}  // namespace
}  // namespace scanrig
