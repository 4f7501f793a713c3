// A calibration is accepted while the process dies: at every point the old file or the new one is whole.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>

#include "tests/component/daemon/calibration_under_test.h"
#include "tests/component/daemon/fake_disk.h"

namespace scanrig {
namespace {

constexpr int kKilled = 9;

class KilledCalibration : public CalibratedRig {
 protected:
  /// A job that is solved, of a daemon that has ended.
  JobInfo solved() {
    boot();
    get_ready();
    const auto id = begin();
    take_placements(0, 6);
    EXPECT_TRUE(wait_state(id, JobState::done));
    const auto info = *job(id);
    shut_down();
    return info;
  }
  /// Accepts in a process of its own that dies at its `n`-th sync of the disk. Returns its exit code.
  int accept_until_sync(const JobInfo& info, int n) {
    const auto child = ::fork();
    if (child == 0) {
      std::atomic<int> syncs = 0;
      fakes::disk().at_sync([&](const std::string&) {
        if (++syncs == n) ::_exit(kKilled);
        return 0;
      });
      const auto store = JobStore::open(options.jobs);
      const bool done = store && store->accept_calibration(info);
      ::_exit(done ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WEXITSTATUS(status);
  }
};

TEST_F(KilledCalibration, LeavesTheOldFileOrTheNewOne) {
  const auto old = rig_file();
  const auto info = solved();
  const auto kept = folder_ / "calibration-20261121T090000Z.json";
  int kills = 0;
  for (int n = 1;; ++n) {
    scan_samples::write_text(options.jobs.calibration_file, old);
    std::filesystem::remove(kept);
    const int end = accept_until_sync(info, n);
    const auto now = rig_file();
    EXPECT_TRUE(now == old || now == new_calibration()) << "killed at sync " << n;
    EXPECT_TRUE(now == old || read_file(kept).value_or("") == old) << "the old one is kept first; sync " << n;
    ASSERT_EQ(accept_until_sync(info, 1000), 0) << "the next attempt succeeds";
    EXPECT_EQ(rig_file(), new_calibration());
    EXPECT_EQ(read_file(kept).value_or(""), old);
    if (end == 0) break;
    EXPECT_EQ(end, kKilled);
    ++kills;
  }
  EXPECT_GE(kills, 4) << "file and folder of both copies";
  const auto again = JobStore::open(options.jobs);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->read(info.id)->calibration->is_accepted);
}

TEST_F(KilledCalibration, AFullDiskLeavesTheOldFile) {
  const auto old = rig_file();
  const auto info = solved();
  fakes::disk().at_sync([](const std::string& path) { return path.find("jobs") == std::string::npos ? ENOSPC : 0; });
  const auto store = JobStore::open(options.jobs);
  ASSERT_TRUE(store);
  EXPECT_EQ(store->accept_calibration(info).error().code, ErrorCode::io);
  fakes::disk().at_sync({});
  EXPECT_EQ(rig_file(), old);
}

}  // namespace
}  // namespace scanrig
