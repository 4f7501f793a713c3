#include "daemon/jobs/job_store.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <regex>

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class JobStoreTest : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    options = {.root = folder_ / "jobs", .calibration_file = folder_ / "calibration.json", .profile = "p"};
  }
  JobStore open() {
    auto store = JobStore::open(options);
    EXPECT_TRUE(store) << store.error().message;
    return std::move(*store);
  }
  /// A job with one view in the state `state`.
  fs::path make_job(const JobStore& store, const std::string& id, const std::string& state) {
    const auto job = store.create(id, {});
    EXPECT_TRUE(job) << job.error().message;
    auto scan = ScanFolder::open(store.folder(id));
    ViewRecord view;
    view.measured_deg = 0.25;
    EXPECT_TRUE(scan->add_view(0, view, scan_samples::raw_view(1)));
    EXPECT_TRUE(scan->set_state(state));
    return scan->path();
  }
  JobInfo recovered(const JobStore& store, const std::string& id) {
    const auto jobs = store.recover();
    EXPECT_TRUE(jobs && jobs->contains(id));
    return *jobs->at(id);
  }
  /// A folder as left by daemons that died during the reconstruction.
  static void write_attempts(const fs::path& folder, int count) {
    scan_samples::write_text(
        folder / "attempt.json",
        fmt::format(R"({{"format": "scanrig-attempt", "version": 1, "count": {}, "process": "x"}})", count));
  }
  JobStoreOptions options;
};

TEST_F(JobStoreTest, AnEmptyRootIsMadeAndHasNoJobs) {
  const auto store = open();
  EXPECT_TRUE(fs::is_directory(options.root));
  EXPECT_TRUE(store.recover()->empty());
}

TEST_F(JobStoreTest, ASecondDaemonIsKeptOutOfTheRoot) {
  const auto store = open();
  const auto second = JobStore::open(options);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::refused);
  EXPECT_THAT(second.error().message, HasSubstr(options.root.string()));
}

TEST_F(JobStoreTest, TheRootIsFreeAgainAfterwards) {
  { const auto store = open(); }
  EXPECT_TRUE(JobStore::open(options));
}

TEST_F(JobStoreTest, ARootThatCannotBeMadeIsAnIoError) {
  scan_samples::write_text(folder_ / "jobs", "a file");
  const auto store = JobStore::open(options);
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().code, ErrorCode::io);
}

TEST_F(JobStoreTest, AMissingCalibrationIsSaidByName) {
  options.calibration_file = folder_ / "nowhere.json";
  const auto store = open();
  const auto scan = store.create("job", {});
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::not_found);
  EXPECT_THAT(scan.error().message, HasSubstr("nowhere.json"));
  EXPECT_FALSE(fs::exists(options.root / "job")) << "nothing half-written";
}

TEST_F(JobStoreTest, AnIdThatIsTakenIsNotOverwritten) {
  const auto store = open();
  make_job(store, "job", "scanned");
  const auto again = store.create("job", {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);
}

TEST_F(JobStoreTest, AJobThatWasBeingScannedIsMarkedInterruptedWithItsViews) {
  const auto store = open();
  for (const std::string state : {"scanning", "waiting_for_flip"}) {
    const auto folder = make_job(store, state, state);
    const auto job = recovered(store, state);
    EXPECT_EQ(job.state, JobState::interrupted);
    ASSERT_EQ(job.stored.size(), 1u);
    EXPECT_EQ(job.stored[0].measured_deg, 0.25);
    EXPECT_EQ(ScanFolder::open(folder)->manifest().state, "interrupted") << "the folder is the truth";
  }
}

TEST_F(JobStoreTest, AnInterruptedJobIsOneToResumeThoughTheDiskDoesNotTakeItsMark) {
  const auto store = open();
  const auto folder = make_job(store, "job", "scanning");
  const auto in_the_way = folder / fmt::format("scan.json.tmp{}", ::getpid());
  fs::create_directory(in_the_way);
  for (const bool disk_is_back : {false, true}) {
    if (disk_is_back) fs::remove(in_the_way);
    const auto job = recovered(store, "job");
    EXPECT_EQ(job.state, JobState::interrupted);
    EXPECT_TRUE(is_resumable(job));
    EXPECT_EQ(job.stored.size(), 1u);
  }
}

TEST_F(JobStoreTest, AScannedJobWithAReportIsDone) {
  const auto store = open();
  const auto folder = make_job(store, "job", "scanned");
  fs::create_directories(model_folder(folder));
  scan_samples::write_text(report_file(folder), "{}");
  const auto job = recovered(store, "job");
  EXPECT_EQ(job.state, JobState::done);
  EXPECT_EQ(job.model, model_file(folder).string());
}

TEST_F(JobStoreTest, AModelTellsWhatTheWatchSaidOfTheRig) {
  const auto store = open();
  const auto folder = make_job(store, "job", "scanned");
  fs::create_directories(model_folder(folder));
  scan_samples::write_text(report_file(folder), R"({"poses": [{"watch": null}, {"watch": {"sentences": ["A moved."]}},
                                                    {"watch": {"sentences": ["A moved.", 7, "B moved."]}}]})");
  EXPECT_THAT(recovered(store, "job").remarks, testing::ElementsAre("A moved.", "B moved."));
  for (const char* const strange : {"", "[]", "{}", R"({"poses": 3})"}) {
    scan_samples::write_text(report_file(folder), strange);
    EXPECT_THAT(recovered(store, "job").remarks, testing::IsEmpty()) << strange;
  }
}

TEST_F(JobStoreTest, AScannedJobWithoutAModelIsToBeReconstructed) {
  const auto store = open();
  make_job(store, "job", "scanned");
  EXPECT_EQ(recovered(store, "job").state, JobState::reconstructing);
}

TEST_F(JobStoreTest, AJobThatTookTwoDaemonsWithItIsInQuarantineWithItsImages) {
  const auto store = open();
  const auto folder = make_job(store, "job", "scanned");
  write_attempts(folder, 1);
  EXPECT_EQ(recovered(store, "job").state, JobState::reconstructing) << "once may be bad luck";
  write_attempts(folder, 2);
  const auto job = recovered(store, "job");
  EXPECT_EQ(job.state, JobState::failed);
  EXPECT_TRUE(job.quarantined);
  EXPECT_THAT(job.error->message, HasSubstr("quarantine"));
  EXPECT_EQ(job.stored.size(), 1u);
  ASSERT_TRUE(begin_attempt(folder));
  EXPECT_EQ(recovered(store, "job").state, JobState::reconstructing) << "a client has requested another try";
}

TEST_F(JobStoreTest, AnOrderOfVersion1IsRead) {
  const auto store = open();
  ASSERT_TRUE(store.create("job", JobFile{.part = "4711", .place = 7}));
  ASSERT_TRUE(write_file_atomically(options.root / "job" / "job.json", R"({
    "format": "scanrig-job", "version": 1, "part": "4711", "place": 7, "exported": false,
    "recipe": { "name": "small", "poses": 1, "views": 5, "flip_timeout_min": 30, "flip_by_line": true,
                "start_on_part": false, "limits": { "least_measured_share": 0.9, "most_residual_mm": 0.05 } } })"));
  const auto recipe = recovered(store, "job").recipe;  // the keys above have their old names
  EXPECT_TRUE(recipe.flip_by_signal);
  EXPECT_FALSE(recipe.fixture);
  EXPECT_EQ(recipe.limits, (Limits{.min_measured_share = 0.9, .max_residual_mm = 0.05}));
}

TEST_F(JobStoreTest, AnOldCalibrationIsReportedWhereThatIsAskedFor) {
  EXPECT_EQ(open().calibration_reminder(), "");
  options.check_calibration_every = std::chrono::hours(24);
  auto text = scan_samples::calibration_json();
  scan_samples::write_text(options.calibration_file, scan_samples::replaced(text, "2026-11-21", "2020-01-01"));
  EXPECT_THAT(open().calibration_reminder(), HasSubstr("not checked for 24 h"));
  ASSERT_TRUE(note_check(options.root, read_calibration(options.calibration_file)->sha256));
  EXPECT_EQ(open().calibration_reminder(), "") << "a check that held is as good as a new one";
  scan_samples::write_text(options.calibration_file, scan_samples::replaced(text, "2026-11-21", "2199-01-01"));
  EXPECT_EQ(open().calibration_reminder(), "");
}

TEST_F(JobStoreTest, ACalibrationKeepsItsKindAndThatItWasAccepted) {
  const auto store = open();
  const JobFile order{.recipe = calibration_recipe(), .accepted = true};
  ASSERT_TRUE(store.create("job", order));
  EXPECT_EQ(recovered(store, "job").recipe, calibration_recipe());
  EXPECT_TRUE(read_job_file(options.root / "job")->accepted);
  EXPECT_EQ(ScanFolder::open(options.root / "job")->manifest().source, "calibration");
}

TEST_F(JobStoreTest, AQueuedJobKeepsItsOrderAndItsPlace) {
  const auto store = open();
  const JobFile order{
      .recipe = {.name = "small", .poses = 1, .views = 5, .fixture = true, .limits = {.min_measured_share = 0.9}},
      .part = "4711",
      .place = 7};
  ASSERT_TRUE(store.create("job", order));
  const auto job = recovered(store, "job");
  EXPECT_EQ(job.state, JobState::queued);
  EXPECT_EQ(job.recipe, order.recipe);
  EXPECT_EQ(job.part, "4711");
  EXPECT_EQ(job.place, 7);
}

TEST_F(JobStoreTest, AnInterruptedJobIsResumableUnlessItsObjectMoved) {
  const auto store = open();
  const auto folder = make_job(store, "job", "interrupted");
  EXPECT_TRUE(is_resumable(recovered(store, "job")));
  ASSERT_TRUE(ScanFolder::open(folder)->add_movement_check(0, {.after_views = 1, .shift_px = 9, .unmoved = false}));
  EXPECT_FALSE(is_resumable(recovered(store, "job")));
  make_job(store, "ended", "cancelled");
  EXPECT_FALSE(is_resumable(recovered(store, "ended")));
}

TEST_F(JobStoreTest, WhatWasLeftOfFoldersHalfMadeOrHalfRemovedGoes) {
  const auto store = open();
  fs::create_directories(options.root / ".new-a" / "pose1");
  fs::create_directories(options.root / ".gone-b");
  EXPECT_TRUE(store.recover()->empty());
  EXPECT_FALSE(fs::exists(options.root / ".new-a"));
  EXPECT_FALSE(fs::exists(options.root / ".gone-b"));
}

TEST_F(JobStoreTest, ARemovedJobIsGone) {
  const auto store = open();
  make_job(store, "job", "cancelled");
  EXPECT_EQ(store.remove("../job").error().code, ErrorCode::not_found);
  ASSERT_TRUE(store.remove("job"));
  EXPECT_FALSE(fs::exists(options.root / "job"));
  EXPECT_EQ(store.remove("job").error().code, ErrorCode::not_found);
}

TEST_F(JobStoreTest, AJobThatDoesNotFitIsRefusedWithFigures) {
  options.reserve_bytes = std::uintmax_t{1} << 60;
  const auto store = open();
  const auto job = store.create("job", {});
  ASSERT_TRUE(job) << job.error().message;
  const auto room = store.check_room(*job);
  ASSERT_FALSE(room);
  EXPECT_EQ(room.error().code, ErrorCode::io);
  EXPECT_THAT(room.error().message, HasSubstr("GiB left"));
}

TEST_F(JobStoreTest, AModelIsJudgedByTheLimitsOfTheRecipe) {
  const auto store = open();
  ASSERT_TRUE(store.create("job", {.recipe = {.limits = {.min_measured_share = 0.9, .max_residual_mm = 0.1}}}));
  const auto folder = store.folder("job");
  ASSERT_TRUE(ScanFolder::open(folder)->set_state("scanned"));
  fs::create_directories(model_folder(folder));
  const auto with = [&](const char* share, const char* residual) {
    scan_samples::write_text(report_file(folder), fmt::format(R"({{"mesh": {{"measured_share": {}}}, "poses":
                             [{{"residual_median_mm": 0.01}}, {{"residual_median_mm": {}}}]}})",
                                                              share, residual));
    return recovered(store, "job");
  };
  EXPECT_EQ(with("0.95", "0.05").passed, true);
  EXPECT_EQ(with("0.85", "0.05").passed, false);
  EXPECT_THAT(with("0.85", "0.05").error->message, HasSubstr("85.0 %"));
  EXPECT_EQ(with("0.95", "0.15").passed, false);
  EXPECT_EQ(with("0.95", "null").passed, false);
  for (const auto* const strange : {"not json", R"({"mesh": [1], "poses": [1]})", R"({"mesh": 1, "poses": 1})"}) {
    scan_samples::write_text(report_file(folder), strange);
    EXPECT_EQ(recovered(store, "job").passed, false) << strange;
  }
}

TEST_F(JobStoreTest, AFailedReconstructionIsRemembered) {
  const auto store = open();
  const auto folder = make_job(store, "job", "scanned");
  ASSERT_TRUE(write_failure(folder, {ErrorCode::same_rest, "the object was not turned over"}));
  const auto job = recovered(store, "job");
  EXPECT_EQ(job.state, JobState::failed);
  EXPECT_EQ(job.error->code, ErrorCode::same_rest);
  EXPECT_EQ(job.error->message, "the object was not turned over");
}

TEST_F(JobStoreTest, AFolderThatCannotBeReadIsAFailedJobAndTheOthersAreListed) {
  const auto store = open();
  make_job(store, "good", "cancelled");
  fs::create_directories(options.root / "bad");
  scan_samples::write_text(options.root / "bad" / "scan.json", "{ not json");
  EXPECT_EQ(recovered(store, "good").state, JobState::cancelled);
  const auto bad = recovered(store, "bad");
  EXPECT_EQ(bad.state, JobState::failed);
  EXPECT_THAT(bad.error->message, HasSubstr("scan.json"));
}

TEST_F(JobStoreTest, ComparesTheSerialNumbersThatAreKnown) {
  struct Case {
    const char *left, *right;
    bool fits;
  };
  for (const auto& [left, right, fits] : {Case{"A1", "A1", true}, Case{"", "", true}, Case{"A1", "", true},
                                          Case{"A1", "B2", false}, Case{"B2", "", false}}) {
    options.cameras = {left, right};
    const auto checked = open().check_rig_cameras();
    EXPECT_EQ(checked.has_value(), fits) << left << " " << right;
    if (!fits) {
      EXPECT_EQ(checked.error().code, ErrorCode::refused);
    }
  }
  scan_samples::write_text(options.calibration_file,
                           std::regex_replace(scan_samples::calibration_json(), std::regex("A1"), ""));
  options.cameras = {"B2", "B3"};
  EXPECT_TRUE(open().check_rig_cameras()) << "a calibration that does not say whose it is";
  std::filesystem::remove(options.calibration_file);
  EXPECT_EQ(open().check_rig_cameras().error().code, ErrorCode::refused);
}

TEST_F(JobStoreTest, AJobWithoutViewsIsGivenTheCalibrationAsItIsNow) {
  const auto store = open();
  const auto made = store.create("a", {.part = "4711", .place = 3});
  ASSERT_TRUE(made);
  const auto manifest = ScanFolder::open(made->folder)->manifest();
  ASSERT_TRUE(store.renew_calibration(*made));
  EXPECT_EQ(ScanFolder::open(made->folder)->manifest().calibration->sha256, manifest.calibration->sha256);
  scan_samples::write_text(fs::path(made->folder) / "log.jsonl", "{}\n");
  scan_samples::write_text(options.calibration_file, scan_samples::calibration_json() + "\n");
  ASSERT_TRUE(store.renew_calibration(*made));
  const auto renewed = ScanFolder::open(made->folder);
  EXPECT_NE(renewed->manifest().calibration->sha256, manifest.calibration->sha256);
  EXPECT_TRUE(renewed->load_calibration());
  EXPECT_EQ(renewed->manifest().created, manifest.created);
  EXPECT_EQ(store.read("a")->part, "4711");
  EXPECT_EQ(store.read("a")->place, 3);
  EXPECT_TRUE(fs::exists(fs::path(made->folder) / "log.jsonl")) << "its log goes with it";
}

}  // namespace
}  // namespace scanrig
