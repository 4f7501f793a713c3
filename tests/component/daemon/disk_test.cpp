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
using What = event::JobRequested::What;

/// A whole daemon on a disk that fails or hangs.
class BadDisk : public Daemon {
 protected:
  void TearDown() override {
    release();
    fakes::disk().at_sync({});
    Daemon::TearDown();
  }
  int exposures() {
    const std::lock_guard guard(rig.line.mutex);
    return rig.line.exposures;
  }
  Result<std::string> resume(const std::string& id) {
    return ask(event::JobRequested{.what = What::resume, .job = id});
  }
  /// From now on a thread that syncs a file of the first pose's second view waits for release().
  void hang() {
    released_ = false;
    fakes::disk().at_sync([this](const std::string& path) {
      if (path.find("/pose1/view01/") == std::string::npos) return 0;
      std::unique_lock lock(mutex_);
      hanging_ = true;
      clock.wait_until(lock, changed_, Clock::TimePoint::max(), [this] { return released_; });
      hanging_ = false;
      return 0;
    });
  }
  void release() {
    {
      const std::lock_guard guard(mutex_);
      released_ = true;
    }
    clock.notify_all(changed_);
  }
  bool hanging() {
    const std::lock_guard guard(mutex_);
    return hanging_;
  }
  /// A scan whose second view is being stored, for as long as the disk takes.
  std::string scan_until_it_hangs() {
    hang();
    boot();
    get_ready();
    rig.panel.press(&PanelInputs::start);
    EXPECT_TRUE(clock_waits_for([this] { return hanging(); }));
    return newest()->id;
  }
  bool table_moves() {
    const std::lock_guard guard(rig.turntable.mutex);
    return rig.turntable.moving;
  }
  static std::vector<int> views_of(const PoseRecord& pose) {
    std::vector<int> indices;
    for (const auto& view : pose.views) indices.push_back(view.index);
    return indices;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool released_ = false;
  bool hanging_ = false;
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
  EXPECT_TRUE(is_resumable(*job(id)));
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

TEST_F(BadDisk, AnOrderItDidNotTakeLeavesNoJob) {
  boot();
  get_ready();
  fakes::disk().at_sync([this](const std::string& path) {
    const bool has_its_name = path == folder_ / "jobs" && !job_folders().empty() &&
                              !job_folders().back().filename().string().starts_with('.');
    return has_its_name ? EIO : 0;
  });
  const auto ordered = ask(JobOrder{});
  ASSERT_FALSE(ordered);
  EXPECT_THAT(ordered.error().message, HasSubstr(std::strerror(EIO)));
  EXPECT_THAT(job_folders(), testing::IsEmpty()) << "the next daemon would scan what was refused";
}

TEST_F(BadDisk, ACancelledJobWhoseReasonItDidNotTakeIsNotQueuedAnyMore) {
  boot();
  get_ready();
  const auto id = ask(JobOrder{});
  ASSERT_TRUE(id) << id.error().message;
  fakes::disk().at_sync([](const std::string& path) { return path.find("failure.json") != path.npos ? EIO : 0; });
  EXPECT_FALSE(ask(event::JobRequested{.what = What::cancel, .job = *id}));
  EXPECT_EQ(job(*id)->state, JobState::cancelled) << "as its folder says";
  EXPECT_THAT(loop->snapshot()->queue, testing::IsEmpty());
}

TEST_F(BadDisk, HangingItIsNamedInTimeAndTheJobGoesOnWhenItAnswers) {
  const auto id = scan_until_it_hangs();
  const auto hangs_since = clock.now();
  ASSERT_TRUE(wait_halted());
  EXPECT_LE(clock.now() - hangs_since, options.disk_limit + seconds(5));
  ASSERT_TRUE(hanging());
  EXPECT_FALSE(table_moves());
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  EXPECT_THAT(job(id)->error->message,
              HasSubstr((folder_ / "jobs").string() + " has not responded for 30 s; check it"));
  EXPECT_THAT(loop->snapshot()->cause, HasSubstr("has not responded for 30 s; check it, then resume the job"));
  EXPECT_THAT(loop->snapshot()->next_action, HasSubstr("Check the job disk"));

  rig.panel.press(&PanelInputs::reset);
  ASSERT_TRUE(wait_ready()) << "the rig itself is well";
  EXPECT_EQ(ask(JobOrder{}).error().code, ErrorCode::io) << "no client is kept waiting for it";
  EXPECT_EQ(resume(id).error().code, ErrorCode::io);
  const auto before = exposures();
  rig.panel.press(&PanelInputs::start);
  clock.sleep_for(seconds(60));
  EXPECT_EQ(exposures(), before) << "nothing is begun";

  release();
  ASSERT_TRUE(clock_waits_for([&] { return job(id)->stored.size() >= 2; })) << "what was taken is stored after all";
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  ASSERT_TRUE(clock_waits_for([&] { return resume(id).has_value(); }));
  scan_both_poses();
  EXPECT_TRUE(wait_state(id, JobState::done));
  const auto scan = only_job();
  for (const auto& pose : scan.manifest().poses) EXPECT_THAT(views_of(pose), ElementsAre(0, 1, 2));
  expect_all_stored_views_readable(scan);
}

TEST_F(BadDisk, HangingItKeepsNobodyWaitingWhoPressesStop) {
  const auto id = scan_until_it_hangs();
  const auto pressed = clock.now();
  rig.panel.press(&PanelInputs::stop);
  ASSERT_TRUE(wait_halted());
  EXPECT_LT(clock.now() - pressed, seconds(5));
  EXPECT_TRUE(hanging());
  EXPECT_FALSE(table_moves());
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  EXPECT_EQ(job(id)->error->message, "Stop was pressed");
  release();
  ASSERT_TRUE(clock_waits_for([&] { return only_job().manifest().state == "interrupted"; }));
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  EXPECT_THAT(loop->snapshot()->queue, testing::IsEmpty());
}

TEST_F(BadDisk, HangingItDoesNotKeepTheDaemonFromEnding) {
  const auto told = std::make_shared<std::string>();
  options.exit_timeout = std::chrono::milliseconds(200);
  options.on_exit_hang = [this, told](const Error& why) {
    *told = why.message;
    release();  // instead of the end of the process
  };
  const auto id = scan_until_it_hangs();
  shut_down();
  EXPECT_TRUE(result) << result.error().message;
  EXPECT_THAT(*told, HasSubstr("disk"));
  EXPECT_FALSE(table_moves());
  options.exit_timeout = seconds(60);
  boot();
  get_ready();
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  EXPECT_GE(job(id)->stored.size(), 1u);
}

}  // namespace
}  // namespace scanrig
