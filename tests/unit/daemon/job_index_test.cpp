#include "daemon/jobs/job_index.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "daemon/jobs/job_store.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

/// The index of a root with two ended jobs and a queued one.
class Index : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    store.emplace(*JobStore::open({.root = folder_ / "jobs", .calibration_file = folder_ / "calibration.json"}));
    const ViewRecord view{
        .index = 0, .measured_deg = 0.25, .retake_reasons = {{ErrorCode::timeout, "left camera: no frame"}}};
    for (const char* id : {"a", "b", "queued"}) {
      ASSERT_TRUE(store->create(id, {.part = std::string("part ") + id}));
      auto scan = ScanFolder::open(store->folder(id));
      scan->taken_under(std::string(64, 'c'));
      ASSERT_TRUE(scan->add_view(0, view, scan_samples::raw_view(1)));
      if (id != std::string("queued")) {
        ASSERT_TRUE(scan->add_movement_check(
            0, {.shift_px = 3, .retake_reasons = {{ErrorCode::protocol, "right camera: torn"}}}));
        ASSERT_TRUE(scan->set_state("failed"));
        ASSERT_TRUE(write_failure(scan->path(), {ErrorCode::moved, "it moved"}));
      }
    }
    expect_all_known();
  }
  fs::path file() const { return folder_ / "jobs" / "index.sqlite"; }
  void expect_all_known() {
    const auto jobs = store->recover();
    ASSERT_TRUE(jobs) << jobs.error().message;
    ASSERT_EQ(jobs->size(), 3u);
    EXPECT_EQ(jobs->at("a")->state, JobState::failed);
    EXPECT_EQ(jobs->at("a")->error->code, ErrorCode::moved);
    EXPECT_EQ(jobs->at("b")->part, "part b");
    EXPECT_EQ(jobs->at("b")->config_sha256, std::vector{std::string(64, 'c')});
    EXPECT_EQ(jobs->at("b")->stored.at(0).measured_deg, 0.25);
    EXPECT_EQ(jobs->at("b")->stored.at(0).retake_reasons.at(0).code, ErrorCode::timeout);
    EXPECT_EQ(jobs->at("b")->stored.at(0).retake_reasons.at(0).message, "left camera: no frame");
    EXPECT_EQ(jobs->at("b")->movement_checks.at(0).retake_reasons.at(0).message, "right camera: torn");
    EXPECT_EQ(jobs->at("queued")->state, JobState::queued);
  }
  bool knows(const std::string& id) { return JobIndex(file()).find(store->folder(id)).has_value(); }

  std::optional<JobStore> store;
};

TEST_F(Index, KnowsEndedJobsAndNoOthers) {
  EXPECT_TRUE(knows("a"));
  EXPECT_TRUE(knows("b"));
  EXPECT_FALSE(knows("queued"));
  expect_all_known();
}

TEST_F(Index, IsAnsweredFromWithoutOpeningTheManifest) {
  // A change that leaves the stamp as it was could not be noticed: that check is what the index saves.
  const auto manifest = store->folder("a") / "scan.json";
  const auto when = fs::last_write_time(manifest);
  auto text = *read_file(manifest);
  text[0] = ' ';
  std::fstream(manifest, std::ios::in | std::ios::out) << text;
  fs::last_write_time(manifest, when);
  expect_all_known();
}

TEST_F(Index, MayBeDeleted) {
  fs::remove(file());
  expect_all_known();
  EXPECT_TRUE(knows("a"));
}

TEST_F(Index, MayBeDamagedInAnyWay) {
  const auto whole = *read_file(file());
  for (std::size_t at = 0; at < whole.size(); at += 97) {
    auto damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0xff);
    scan_samples::write_text(file(), damaged);
    ASSERT_NO_FATAL_FAILURE(expect_all_known()) << "damaged at " << at;
  }
  for (const auto& text : {std::string(), std::string("no database"), whole.substr(0, whole.size() / 2)}) {
    scan_samples::write_text(file(), text);
    expect_all_known();
    EXPECT_TRUE(knows("b"));
  }
}

TEST_F(Index, MayBeAnotherProgramsDatabase) {
  fs::remove(file());
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file().c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "CREATE TABLE jobs (colour TEXT)", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
  expect_all_known();
  EXPECT_TRUE(knows("a"));
}

TEST_F(Index, MayBeAFolder) {
  fs::remove(file());
  fs::create_directories(file() / "in the way");
  EXPECT_EQ(store->recover()->at("a")->state, JobState::failed);
}

TEST_F(Index, ForgetsWhatHasChangedSince) {
  ASSERT_TRUE(ScanFolder::open(store->folder("a"))->set_state("cancelled"));
  EXPECT_FALSE(knows("a"));
  EXPECT_EQ(store->recover()->at("a")->state, JobState::cancelled);
  EXPECT_TRUE(knows("a"));
}

}  // namespace
}  // namespace scanrig
