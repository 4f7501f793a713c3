#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <condition_variable>
#include <mutex>
#include <set>

#include "daemon/jobs/housekeeping_thread.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using std::chrono::days;
using std::chrono::hours;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto kTenYears = days(3653);

/// Set by the test while the housekeeping does not sweep.
class SetTime final : public SystemTime {
 public:
  [[nodiscard]] TimeReading read(const std::stop_token&) const override {
    return {.wall = std::chrono::system_clock::time_point(now + wrong_by),
            .is_synchronized = is_synchronized,
            .running = now - switched_on};
  }
  seconds now = days(20'000);
  seconds wrong_by{0};
  bool is_synchronized = true;
  seconds switched_on = now;
};

class RetentionSweeps : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    auto opened = JobStore::open({.root = folder_ / "jobs", .calibration_file = folder_ / "calibration.json"});
    ASSERT_TRUE(opened) << opened.error().message;
    store.emplace(std::move(*opened));
    options.keep_for = days(30);
    options.time = time;
    restart();
  }
  /// A job that has ended now, with file times from the wall clock.
  void make_job(const std::string& id, const std::string& state = "cancelled", bool exported = true) {
    ASSERT_TRUE(store->create(id, {.recipe = {.poses = 1, .views = 2}, .exported = exported}));
    auto scan = ScanFolder::open(store->folder(id));
    ASSERT_TRUE(scan->add_view(0, {.index = 0}, scan_samples::raw_view(0)));
    ASSERT_TRUE(scan->set_state(state));
    const timespec stamp{.tv_sec = (time->now + time->wrong_by).count(), .tv_nsec = 0};
    const timespec both[] = {stamp, stamp};
    for (const char* const file : {"scan.json", "job.json"}) {
      ASSERT_EQ(::utimensat(AT_FDCWD, (store->folder(id) / file).c_str(), both, 0), 0);
    }
    auto info = store->read(id);
    ASSERT_TRUE(info);
    const std::lock_guard guard(mutex);
    table[id] = std::make_shared<const JobInfo>(std::move(*info));
  }
  /// The daemon ends and another one starts.
  void restart() {
    housekeeping.reset();
    housekeeping.emplace(
        clock, *store, options,
        [this] {
          const std::lock_guard guard(mutex);
          return table;
        },
        [this](const Event& event) { take(event); });
  }
  void switch_off_for(seconds duration) {
    housekeeping.reset();
    time->now += duration;
    time->switched_on = time->now;
    restart();
  }
  void take(const Event& event) {
    const std::lock_guard guard(mutex);
    if (const auto* removed = std::get_if<event::JobRemoved>(&event)) table.erase(removed->job);
    if (std::holds_alternative<event::RequestDone>(event)) ++answers;
    changed.notify_all();
  }
  /// Sweeps; returns the remaining jobs.
  std::vector<std::string> sweep() {
    std::unique_lock lock(mutex);
    const int before = answers;
    housekeeping->sweep();
    housekeeping->post({.what = event::JobRequested::What::remove, .job = "none", .request_id = 1});
    EXPECT_TRUE(changed.wait_for(lock, std::chrono::minutes(1), [&] { return answers > before; }));
    std::vector<std::string> left;
    for (const auto& [id, job] : table) {
      EXPECT_TRUE(fs::exists(store->folder(id)));
      left.push_back(id);
    }
    return left;
  }

  RealClock clock;
  std::shared_ptr<SetTime> time = std::make_shared<SetTime>();
  RetentionOptions options;
  std::optional<JobStore> store;
  std::mutex mutex;
  std::condition_variable changed;
  JobTable table;
  int answers = 0;
  std::optional<HousekeepingThread> housekeeping;
};

TEST_F(RetentionSweeps, AnExportedJobIsRemovedWhenItsTimeIsOver) {
  make_job("job");
  EXPECT_THAT(sweep(), ElementsAre("job"));
  time->now += days(15);
  EXPECT_THAT(sweep(), ElementsAre("job"));
  switch_off_for(days(14));
  EXPECT_THAT(sweep(), ElementsAre("job"));
  time->now += days(2);
  EXPECT_THAT(sweep(), IsEmpty());
}

TEST_F(RetentionSweeps, WhatWasNotExportedOrCanBeResumedStays) {
  make_job("cancelled", "cancelled", false);
  make_job("interrupted", "interrupted");
  make_job("removable");
  options.keep_bytes = 1;
  restart();
  EXPECT_THAT(sweep(), ElementsAre("cancelled", "interrupted"));
  time->now += days(9999);
  EXPECT_THAT(sweep(), ElementsAre("cancelled", "interrupted"));
}

/// The clock jumps ten years ahead or back and returns: while the daemon runs, over a restart and over a time off,
/// before and after it is synchronized. A job ends under every clock. None of them is 30 days old in the end.
TEST_F(RetentionSweeps, NoJobIsLostToAClockSetTenYearsOnAndBack) {
  const auto move_on = [this](int how) {
    time->now += hours(1);
    if (how == 1) restart();
    if (how == 2) switch_off_for(hours(1));
  };
  std::set<std::string> made;
  const auto end_a_job = [&] {
    made.insert("job" + std::to_string(100 + made.size()));
    make_job(*made.rbegin());
    sweep();
  };
  end_a_job();
  for (const auto wrong_by : {kTenYears, -kTenYears}) {
    for (const bool is_synchronized : {false, true}) {
      for (const int how : {0, 1, 2}) {
        move_on(how);
        time->wrong_by = wrong_by;
        time->is_synchronized = is_synchronized;
        end_a_job();
        time->is_synchronized = true;  // before it is set right
        sweep();
        move_on(how);
        time->wrong_by = seconds(0);
        end_a_job();
      }
    }
  }
  time->now += days(28);
  EXPECT_THAT(sweep(), testing::ElementsAreArray(made)) << "jobs were lost that had to stay";
  time->now += days(3);
  EXPECT_THAT(sweep(), IsEmpty()) << "their time is over";
}

TEST_F(RetentionSweeps, RoomIsMadeInTheOrderOfEndingWhateverTheClockShowed) {
  time->wrong_by = kTenYears;
  make_job("20361121-000000-1");
  sweep();
  time->wrong_by = -kTenYears;
  make_job("20161121-000000-1");
  sweep();
  time->wrong_by = seconds(0);
  make_job("20261121-000000-1");
  sweep();
  options.keep_bytes = 2 * measure_folder(store->folder("20261121-000000-1")).bytes + 1000;
  restart();
  EXPECT_THAT(sweep(), ElementsAre("20161121-000000-1", "20261121-000000-1"));
}

TEST_F(RetentionSweeps, AJobThatEndsAnewCountsAnew) {
  make_job("job");
  sweep();
  time->now += days(29);
  ASSERT_TRUE(ScanFolder::open(store->folder("job"))->set_state("failed"));
  EXPECT_THAT(sweep(), ElementsAre("job"));
  time->now += days(29);
  EXPECT_THAT(sweep(), ElementsAre("job"));
  time->now += days(2);
  EXPECT_THAT(sweep(), IsEmpty());
}

TEST_F(RetentionSweeps, WithoutItsLedgerEveryJobStaysForItsWholeTime) {
  make_job("job");
  sweep();
  time->now += days(29);
  sweep();
  ASSERT_TRUE(fs::remove(folder_ / "jobs" / "retention.json"));
  restart();
  time->now += days(29);
  EXPECT_THAT(sweep(), ElementsAre("job"));
}

TEST(SystemTimeOfThisMachine, RunsOn) {
  const auto time = system_time();
  const auto first = time->read({});
  const auto second = time->read({});
  EXPECT_GE(second.running, first.running);
  EXPECT_LT(std::chrono::abs(second.wall - std::chrono::system_clock::now()), std::chrono::minutes(1));
}

}  // namespace
}  // namespace scanrig
