#include <gmock/gmock.h>

#include <future>
#include <nlohmann/json.hpp>

#include "daemon/jobs/executors.h"
#include "pipeline/calibration/camera.h"
#include "tests/component/daemon/daemon_under_test.h"
#include "tests/component/daemon/fake_slurm.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using fakes::comes_true;
using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr const char* kMakes = "mkdir $out; echo cluster > $out/model.glb\n";

SlurmExecutorOptions quick(const fs::path& commands, const fs::path& folder) {
  SlurmExecutorOptions options;
  options.commands = commands;
  options.program = folder / "on node";
  options.away_limit = std::chrono::seconds(20);
  options.local.program = folder / "here";
  options.poll = milliseconds(20);
  options.files_every = milliseconds(5);
  options.files_limit = milliseconds(500);
  return options;
}

void write_program(const fs::path& file, const std::string& script) {
  scan_samples::write_text(file, "#!/bin/sh\nout=$5\n" + script);
  ::chmod(file.c_str(), 0755);
}

/// Models made by jobs of a cluster, through commands that a test holds.
class Slurm : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    fs::create_directories(scan_);
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    scan_samples::write_text(scan_ / "scan.json", "{}");
    slurm.emplace(folder_ / "commands");
    options = quick(slurm->commands(), folder_);
    on_node(kMakes);
    write_program(folder_ / "here", "mkdir $out; echo here > $out/model.glb");
  }
  void TearDown() override {
    slurm.reset();
    FolderTest::TearDown();
  }
  void on_node(const std::string& script) const { write_program(folder_ / "on node", script); }
  /// A program that waits for the file `go`, then makes the model.
  void on_node_after_go() const {
    on_node(
        fmt::format("touch '{0}/begun'; while [ ! -e '{0}/go' ]; do sleep 0.02; done\n{1}", folder_.string(), kMakes));
  }
  void let_go() const { scan_samples::write_text(folder_ / "go", ""); }
  [[nodiscard]] bool begun() const {
    return comes_true([&] { return fs::exists(folder_ / "begun"); });
  }

  Result<void> finish(ReconstructionChanges changes = {}) {
    const auto calibration = read_calibration(folder_ / "calibration.json");
    if (!calibration) return pass_on(calibration);
    const auto made = slurm_reconstructor(options)(
        {.calibration = *calibration, .folder = scan_, .views = 1, .changes = std::move(changes), .is_ending = [this] {
           return ending.load();
         }});
    if (!made) return pass_on(made);
    const auto note = [this](std::string_view stage, double fraction) {
      stages += fmt::format("{} {} ", stage, fraction);
    };
    return (*made)->finish(scan_ / "model", {stop.get_token(), note});
  }
  std::future<Result<void>> finish_meanwhile() {
    return std::async(std::launch::async, [this] { return finish(); });
  }
  /// The daemon ends while the job runs.
  void end_daemon(std::future<Result<void>>& done) {
    ending = true;
    stop.request_stop();
    EXPECT_EQ(done.get().error().code, ErrorCode::stopped);
    ending = false;
    stop = std::stop_source();
  }
  void expect_failed(ErrorCode code, const std::string& words) {
    const auto done = finish();
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, code) << done.error().message;
    EXPECT_THAT(done.error().message, HasSubstr(words));
    EXPECT_FALSE(fs::exists(scan_ / "model"));
    expect_nothing_left();
  }
  void expect_nothing_left() const {
    EXPECT_FALSE(fs::exists(scan_ / "slurm.json"));
    EXPECT_FALSE(fs::exists(scan_ / "slurm"));
    EXPECT_FALSE(fs::exists(scan_ / "model.new"));
  }
  [[nodiscard]] std::string model() const { return read_file(scan_ / "model" / "model.glb").value_or("none"); }

  fs::path scan_ = folder_ / "20261121-093000-1";
  std::optional<fakes::FakeSlurm> slurm;
  SlurmExecutorOptions options;
  std::stop_source stop;
  std::atomic<bool> ending = false;
  std::string stages;
};

TEST_F(Slurm, AScanIsSubmittedAndItsModelTaken) {
  options.partition = "fast";
  options.options = {"--qos=low"};
  options.local.memory_bytes = std::uintmax_t{3} << 30;
  options.local.limit = std::chrono::minutes(90);
  options.local.voxel_mm = 0.5;
  on_node(std::string("printf 'volume\\t0.5\\n'; echo \"$@\" > " + (folder_ / "words").string() + "\n") + kMakes);
  const auto done = finish();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(model(), "cluster\n");
  EXPECT_THAT(stages, HasSubstr("volume 0.5"));
  EXPECT_THAT(slurm->name(1), testing::StartsWith("scanrig-20261121-093000-1-"));
  for (const char* word : {"--partition=fast", "--qos=low", "--mem=3072M", "--time=90", "--cpus-per-task=2"}) {
    EXPECT_THAT(slurm->submissions(), HasSubstr(word));
  }
  EXPECT_THAT(*read_file(folder_ / "words"), HasSubstr("--voxel-mm 0.5 --threads 2"));
  expect_nothing_left();
}

TEST_F(Slurm, AnEarlierModelIsReplacedAsAWhole) {
  fs::create_directories(scan_ / "model");
  scan_samples::write_text(scan_ / "model" / "old", "");
  ASSERT_TRUE(finish());
  EXPECT_FALSE(fs::exists(scan_ / "model" / "old"));
}

TEST_F(Slurm, AReconstructionThatFailsSaysWhy) {
  on_node("printf 'failed\\tsame_rest\\tthe object was not turned over\\n'; exit 7");
  expect_failed(ErrorCode::same_rest, "was not turned over");
  on_node("mkdir $out; kill -SEGV $$");
  expect_failed(ErrorCode::internal, "Segmentation fault");
  on_node("echo 'it is raining' >&2; exit 3");
  expect_failed(ErrorCode::internal, "ended with 3: it is raining");
}

TEST_F(Slurm, ACancelledJobIsGoneFromTheCluster) {
  on_node_after_go();
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  stop.request_stop();
  EXPECT_EQ(done.get().error().code, ErrorCode::stopped);
  EXPECT_EQ(slurm->state(1), "CANCELLED");
  expect_nothing_left();
}

TEST_F(Slurm, AJobOfALostNodeIsSubmittedAgain) {
  on_node_after_go();
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  slurm->kill(1);
  slurm->set_state(1, "NODE_FAIL");
  ASSERT_TRUE(comes_true([&] { return slurm->jobs() == 2; }));
  let_go();
  EXPECT_TRUE(done.get());
  EXPECT_EQ(model(), "cluster\n");
}

TEST_F(Slurm, ARunThatLivesOnOnALostNodeChangesNothing) {
  on_node(fmt::format("if mkdir '{0}/first'; then while [ ! -e '{0}/go' ]; do sleep 0.02; done; fi\n{1}",
                      folder_.string(), kMakes));
  auto done = finish_meanwhile();
  ASSERT_TRUE(comes_true([&] { return fs::exists(folder_ / "first"); }));
  slurm->set_state(1, "NODE_FAIL");
  ASSERT_TRUE(done.get());
  fs::remove_all(scan_ / "model");
  let_go();
  ASSERT_TRUE(comes_true([&] { return slurm->state(1) == "FAILED"; })) << "it has no folder to write to";
  EXPECT_FALSE(fs::exists(scan_ / "model"));
}

TEST_F(Slurm, NodesThatAreLostAgainAndAgainFailTheJobByName) {
  options.resubmits = 1;
  options.files_limit = milliseconds(0);
  on_node_after_go();
  auto done = finish_meanwhile();
  for (const int id : {1, 2}) {
    ASSERT_TRUE(comes_true([&] { return slurm->jobs() == id && !slurm->state(id).empty(); }));
    slurm->kill(id);
    slurm->set_state(id, "NODE_FAIL");
  }
  const auto error = done.get().error();
  EXPECT_EQ(error.code, ErrorCode::timeout);
  EXPECT_THAT(error.message, HasSubstr("lost the job 2 times, at last as job 2"));
  expect_nothing_left();
}

TEST_F(Slurm, LimitsOfTheClusterAreNamed) {
  for (const auto& [state, code, words] : {std::tuple("TIMEOUT", ErrorCode::timeout, "after its 60 min"),
                                           std::tuple("OUT_OF_MEMORY", ErrorCode::out_of_range, "6144 MiB"),
                                           std::tuple("CANCELLED", ErrorCode::stopped, "cancelled at the cluster")}) {
    fs::remove(folder_ / "begun");
    on_node_after_go();
    auto done = finish_meanwhile();
    ASSERT_TRUE(begun());
    slurm->kill(slurm->jobs());
    slurm->set_state(slurm->jobs(), state);
    const auto error = done.get().error();
    EXPECT_EQ(error.code, code);
    EXPECT_THAT(error.message, HasSubstr(words));
  }
}

TEST_F(Slurm, ANodeThatDoesNotSeeTheFolderIsNamed) {
  slurm->set("blind");
  expect_failed(ErrorCode::not_found, "n1 does not see");
}

TEST_F(Slurm, WhatSlurmRefusesIsNotTriedElsewhere) {
  options.fallback = SlurmExecutorOptions::Fallback::local;
  slurm->set("refuses");
  expect_failed(ErrorCode::refused, "Invalid partition name");
  options.commands = folder_ / "nowhere";
  expect_failed(ErrorCode::not_found, "no command sbatch");
}

TEST_F(Slurm, WithoutAControllerTheModelIsMadeHere) {
  options.fallback = SlurmExecutorOptions::Fallback::local;
  slurm->set("away");
  const auto done = finish();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(model(), "here\n");
  expect_nothing_left();
}

TEST_F(Slurm, OrTheControllerIsWaitedFor) {
  slurm->set("away");
  auto done = finish_meanwhile();
  ASSERT_TRUE(comes_true([&] { return !slurm->submissions().empty(); }));
  slurm->remove("away");
  ASSERT_TRUE(done.get());
  EXPECT_EQ(model(), "cluster\n");
  EXPECT_THAT(stages, HasSubstr("no cluster"));
  slurm->set("away");
  fs::remove_all(scan_ / "model");
  options.away_limit = std::chrono::seconds(0);
  expect_failed(ErrorCode::timeout, "no Slurm controller");
}

TEST_F(Slurm, AControllerThatRestartsMeanwhileChangesNothing) {
  on_node_after_go();
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  slurm->set("away");
  std::this_thread::sleep_for(milliseconds(200));  // some questions are in vain
  slurm->remove("away");
  let_go();
  EXPECT_TRUE(done.get());
  EXPECT_EQ(slurm->jobs(), 1);
}

TEST_F(Slurm, AControllerThatStaysAwayFailsTheJob) {
  options.away_limit = std::chrono::seconds(1);
  on_node_after_go();
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  slurm->set("away");
  const auto error = done.get().error();
  EXPECT_EQ(error.code, ErrorCode::timeout);
  EXPECT_THAT(error.message, HasSubstr("while job 1 runs"));
}

TEST_F(Slurm, ADaemonThatComesBackTakesUpItsJob) {
  on_node_after_go();
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  const auto record = scan_ / "slurm.json";
  ASSERT_TRUE(comes_true([&] { return read_file(record).value_or("").find(R"("job": "1")") != std::string::npos; }));
  end_daemon(done);
  EXPECT_EQ(slurm->state(1), "RUNNING");

  done = finish_meanwhile();
  let_go();
  EXPECT_TRUE(done.get());
  EXPECT_EQ(slurm->jobs(), 1) << "it is not submitted twice";
  EXPECT_EQ(model(), "cluster\n");
  expect_nothing_left();
}

TEST_F(Slurm, AJobThatWasSubmittedAndNotRecordedIsFoundByItsName) {
  on_node_after_go();
  slurm->set("deaf");
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  end_daemon(done);
  EXPECT_THAT(*read_file(scan_ / "slurm.json"), HasSubstr(R"("job": "")"));

  done = finish_meanwhile();
  let_go();
  EXPECT_TRUE(done.get());
  EXPECT_EQ(slurm->jobs(), 1);
}

TEST_F(Slurm, AResultThatCameWhileNoDaemonRanIsTaken) {
  on_node_after_go();
  slurm->set("deaf");
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  end_daemon(done);
  let_go();
  ASSERT_TRUE(comes_true([&] { return slurm->state(1) == "COMPLETED"; }));
  EXPECT_TRUE(finish());
  EXPECT_EQ(slurm->jobs(), 1);
}

TEST_F(Slurm, AJobForOtherOptionsIsCancelled) {
  on_node_after_go();
  auto done = finish_meanwhile();
  ASSERT_TRUE(begun());
  end_daemon(done);
  on_node(kMakes);
  EXPECT_TRUE(finish({.voxel_mm = 0.7}));
  EXPECT_EQ(slurm->state(1), "CANCELLED");
  EXPECT_EQ(slurm->jobs(), 2);
}

TEST_F(Slurm, AStageIsForNodesWithoutTheFolderOfJobs) {
  options.stage = folder_ / "stage";
  fs::create_directories(options.stage);
  fs::create_directories(scan_ / "pose1" / "view00");
  scan_samples::write_text(scan_ / "pose1" / "view00" / "left_plain.png", "x");
  fs::create_directories(scan_ / "model");
  on_node(
      "test -e $2/pose1/view00/left_plain.png -a ! -e $2/model || exit 3\ncase $2 in */stage/*) ;; *) exit 4;; esac\n" +
      std::string(kMakes));
  const auto done = finish();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(model(), "cluster\n");
  EXPECT_TRUE(fs::is_empty(options.stage));
  expect_nothing_left();
}

TEST_F(Slurm, WhatANodeFoundSeveralWaysToFitComesBackFromTheStage) {
  options.stage = folder_ / "stage";
  fs::create_directories(options.stage);
  on_node("mkdir $2/choices; echo found > $2/choices/choices.json; exit 7\n");
  EXPECT_FALSE(finish());
  EXPECT_EQ(read_file(scan_ / "choices" / "choices.json").value_or("none"), "found\n");
  on_node("test -e $2/choices/choices.json || exit 3\n" + std::string(kMakes));
  EXPECT_TRUE(finish()) << "the node reads what was picked";
  EXPECT_TRUE(fs::is_empty(options.stage));
}

/// The whole daemon with such a cluster.
class DaemonWithSlurm : public Daemon {};

TEST_F(DaemonWithSlurm, EndsAndComesBackWhileItsJobRuns) {
  {
    const fakes::FakeSlurm slurm(folder_ / "commands");
    options.reconstructor = slurm_reconstructor(quick(slurm.commands(), folder_));
    write_program(folder_ / "on node",
                  fmt::format("while [ ! -e '{0}/go' ]; do sleep 0.02; done\nmkdir $out; echo glTF > $out/model.glb; "
                              "echo '{{}}' > $out/report.json",
                              folder_.string()));
    boot();
    get_ready();
    scan_both_poses();
    at_the_rig.reset();  // the clock moves without the operator, until the reconstruction begins
    ASSERT_TRUE(comes_true(
        [&] { return fs::exists(job_folders().at(0) / "slurm.json") && slurm.jobs() == 1 && slurm.runs(1); }));
    shut_down();
    EXPECT_EQ(slurm.state(1), "RUNNING");
    scan_samples::write_text(folder_ / "go", "");
    boot();
    ASSERT_TRUE(wait_halted());
    EXPECT_TRUE(wait_state(newest()->id, JobState::done));
    EXPECT_EQ(slurm.jobs(), 1);
    EXPECT_FALSE(fs::exists(job_folders().at(0) / "attempt.json"));
  }
}

}  // namespace
}  // namespace scanrig
