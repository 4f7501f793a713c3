#include <gmock/gmock.h>
#include <sys/stat.h>

#include <atomic>
#include <new>

#include "daemon/jobs/executors.h"
#include "tests/component/daemon/daemon_under_test.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using What = event::JobRequested::What;

/// Reconstructions that go wrong: the rig continues, and the job reports what happened.
class Executor : public Daemon {
 protected:
  /// A program in place of the scanrig command: `script` finds the model's folder in $out.
  void execute(const std::string& script) {
    const auto program = folder_ / "scanrig";
    scan_samples::write_text(program, "#!/bin/sh\nout=$5\n" + script);
    ::chmod(program.c_str(), 0755);
    options.reconstructor = process_reconstructor({.program = program, .limit = std::chrono::seconds(20)});
  }
  std::string scan() {
    scan_both_poses();
    EXPECT_TRUE(wait_ready());
    return newest()->id;
  }
  void expect_failed(const std::string& id, ErrorCode code, const std::string& words) {
    EXPECT_TRUE(wait_state(id, JobState::failed));
    EXPECT_EQ(job(id)->error->code, code);
    EXPECT_THAT(job(id)->error->message, HasSubstr(words));
    EXPECT_FALSE(fs::exists(model_folder(job(id)->folder)));
    EXPECT_FALSE(fs::exists(fs::path(job(id)->folder) / "attempt.json"));
  }
  /// A folder as left by daemons that died during the reconstruction.
  static void write_attempts(const fs::path& folder, int count) {
    scan_samples::write_text(
        folder / "attempt.json",
        fmt::format(R"({{"format": "scanrig-attempt", "version": 1, "count": {}, "process": "x"}})", count));
  }
  /// Start; then in the exposure after `fires` others the power fails: the next daemon finds the disk as it was.
  void cut_power_after(int fires) {
    std::atomic<bool> cut = false;
    rig.line.fires_before = fires;
    rig.line.at_fire = [&] {
      clock.sleep_for(std::chrono::seconds(2));  // the disk is idle
      fs::copy(folder_ / "jobs", folder_ / "cut", fs::copy_options::recursive);
      cut = true;
    };
    rig.panel.press(&PanelInputs::start);
    ASSERT_TRUE(clock_waits_for([&] { return cut.load(); }));
    shut_down();
    fs::remove_all(folder_ / "jobs");
    fs::rename(folder_ / "cut", folder_ / "jobs");
    for (const auto& folder : job_folders()) {
      const auto attempts = read_attempt_record(folder);
      if (attempts.running) write_attempts(folder, attempts.ended_by_death + 1);  // that process has ended
    }
    boot();
    get_ready();
  }
  void resume(const std::string& id) {
    const auto resumed = ask(event::JobRequested{.what = What::resume, .job = id});
    ASSERT_TRUE(resumed) << resumed.error().message;
  }
};

TEST_F(Executor, WhatIsThrownFailsTheJobOnly) {
  log.at_finish = [] { throw std::runtime_error("out of the blue"); };
  boot();
  get_ready();
  expect_failed(scan(), ErrorCode::internal, "out of the blue");
  log.at_finish = [] { throw std::bad_alloc(); };
  expect_failed(scan(), ErrorCode::out_of_range, "memory");
  log.at_finish = [] {};
  EXPECT_TRUE(wait_state(scan(), JobState::done));
}

TEST_F(Executor, AJobIsMarkedWhileItsModelIsMade) {
  bool marked = false;
  log.at_finish = [&] { marked = read_attempt_record(job_folders().at(0)).running; };
  boot();
  get_ready();
  const auto id = scan();
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_TRUE(marked);
  EXPECT_FALSE(read_attempt_record(job(id)->folder).running);
}

TEST_F(Executor, PowerCutsDuringTheScanAreNoDeathsOverItsModel) {
  boot();
  get_ready();
  cut_power_after(2 * 1);
  const auto id = newest()->id;
  EXPECT_FALSE(fs::exists(job_folders().at(0) / "attempt.json"));
  resume(id);
  cut_power_after(2 * (1 + 1));
  EXPECT_EQ(job(id)->stored.size(), 2u);
  resume(id);
  scan_both_poses();
  EXPECT_TRUE(wait_state(id, JobState::done)) << to_string(job(id)->state);
}

TEST_F(Executor, AScanTheDaemonDiedOverGoesOnAloneAndIsModelledAfterwards) {
  boot();
  get_ready();
  cut_power_after(2 * 1);
  const auto id = newest()->id;
  log.calls.clear();
  resume(id);
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  clock.sleep_for(std::chrono::minutes(1));
  {
    const std::lock_guard guard(log.mutex);
    EXPECT_THAT(log.calls, IsEmpty()) << "what may have ended the daemon does not do so beside the moving table again";
  }
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_THAT(log.calls, testing::ElementsAre("view 0/0", "view 0/1", "view 0/2", "pose 0", "view 1/0", "view 1/1",
                                              "view 1/2", "pose 1", "finish"));
}

TEST_F(Executor, AnEndOnPurposeIsNoDeathHoweverLongTheStageTakes) {
  std::atomic<bool> marked = false, unmarked = false;
  log.at_finish = [&] {
    const auto mark = job_folders().at(0) / "attempt.json";
    marked = fs::exists(mark);
    unmarked = clock_waits_for([&] { return !fs::exists(mark); });
  };
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(clock_waits_for([&] { return marked.load(); }));
  shut_down();
  EXPECT_TRUE(unmarked);
  EXPECT_EQ(read_attempt_record(job_folders().at(0)).ended_by_death, 0);
}

TEST_F(Executor, TheDaemonsDeathIsTriedOnceMoreThenTheJobIsInQuarantine) {
  boot();
  get_ready();
  const auto id = scan();
  ASSERT_TRUE(wait_state(id, JobState::done));
  shut_down();
  const auto folder = job_folders().at(0);
  write_attempts(folder, 1);
  boot();
  EXPECT_TRUE(wait_state(id, JobState::done)) << "once may be bad luck";
  shut_down();
  write_attempts(folder, 2);
  boot();
  get_ready();
  EXPECT_TRUE(job(id)->quarantined);
  EXPECT_THAT(job(id)->error->message, HasSubstr("quarantine"));
  EXPECT_TRUE(ask(event::JobRequested{.what = What::reprocess, .job = id}));
  EXPECT_TRUE(wait_state(id, JobState::done)) << "a client requested another try";
}

TEST_F(Executor, AScanThatGoesOnInQuarantineTakesItsViewsAndSaysSo) {
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([&] { return newest() && !newest()->stored.empty(); }));
  const auto id = newest()->id;
  shut_down();
  write_attempts(job_folders().at(0), 2);
  boot();
  get_ready();
  ASSERT_TRUE(ask(event::JobRequested{.what = What::resume, .job = id}));
  scan_both_poses();
  EXPECT_TRUE(wait_state(id, JobState::failed));
  EXPECT_TRUE(job(id)->quarantined);
  EXPECT_THAT(job(id)->error->message, HasSubstr("quarantine"));
  ASSERT_TRUE(ask(event::JobRequested{.what = What::reprocess, .job = id}));
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_FALSE(job(id)->quarantined);
}

TEST_F(Executor, AScanThatBeginsWhileAModelIsMadeIsReconstructedOnce) {
  options.recipes["default"].poses = 1;
  log.at_finish = [this, first = true]() mutable {
    if (!std::exchange(first, false)) return;
    EXPECT_TRUE(clock_waits_for([this] { return loop->snapshot()->jobs.size() == 2 && newest()->stored.size() == 3; }));
  };
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([this] { return newest() && newest()->state == JobState::reconstructing; }));
  ASSERT_TRUE(wait_ready());
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([this] { return loop->snapshot()->jobs.size() == 2; }));
  EXPECT_TRUE(wait_state(newest()->id, JobState::done));
  shut_down();
  const std::vector<std::string> job{"view 0/0", "view 0/1", "view 0/2", "pose 0", "finish"};
  auto both = job;
  both.insert(both.end(), job.begin(), job.end());
  EXPECT_THAT(log.calls, ElementsAreArray(both));
}

TEST_F(Executor, AReportNobodyForesawPassesNothing) {
  options.recipes["default"].limits = {.min_measured_share = 0.9, .max_residual_mm = 0.1};
  execute(R"(mkdir $out; echo glTF > $out/model.glb; echo '{"mesh": [1], "poses": [1]}' > $out/report.json)");
  boot();
  get_ready();
  const auto id = scan();
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(job(id)->passed, false);
  shut_down();
  boot();
  EXPECT_EQ(job(id)->passed, false);
}

TEST_F(Executor, AHookThatThrowsInterruptsItsJobOnly) {
  options.on_scanned = [thrown = false](const auto&) mutable -> Result<void> {
    if (std::exchange(thrown, true)) return {};
    throw std::runtime_error("out of the blue");
  };
  boot();
  get_ready();
  const auto id = scan();
  EXPECT_TRUE(wait_state(id, JobState::interrupted));
  EXPECT_THAT(job(id)->error->message, HasSubstr("out of the blue"));
  EXPECT_THAT(loop->snapshot()->next_action, Not(HasSubstr("disk"))) << "it is not at fault";
  EXPECT_FALSE(rig.turntable.moving);
  EXPECT_TRUE(wait_state(scan(), JobState::done));
}

TEST_F(Executor, AModelIsMadeAgainWithOtherOptions) {
  std::vector<std::pair<std::optional<double>, std::string>> asked;
  const auto fake = options.reconstructor;
  options.reconstructor = [&](const ReconstructionTask& task) {
    asked.emplace_back(task.changes.voxel_mm, task.changes.fusion);
    return fake(task);
  };
  boot();
  get_ready();
  const auto id = scan();
  ASSERT_TRUE(wait_state(id, JobState::done));
  ASSERT_TRUE(ask(event::JobRequested{.what = What::reprocess, .job = id, .voxel_mm = 0.5, .fusion = "paper"}));
  EXPECT_TRUE(wait_state(id, JobState::done));
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[1].first, 0.5);
  EXPECT_EQ(asked[1].second, "paper");
  EXPECT_EQ(ask(event::JobRequested{.what = What::reprocess, .job = "none"}).error().code, ErrorCode::not_found);
}

TEST_F(Executor, AJobThatWouldNeedTooMuchMemoryIsRefusedBeforeItStarts) {
  options.reconstructor = [](const ReconstructionTask&) -> Result<std::unique_ptr<Reconstructor>> {
    return fail(ErrorCode::out_of_range, "would need 12 GiB");
  };
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_fail()) << "and no operator turns the part over for nothing";
  EXPECT_THAT(newest()->error->message, HasSubstr("12 GiB"));
}

TEST_F(Executor, AProcessMakesTheModelAndTellsItsProgress) {
  execute("printf 'volume\\t0.5\\n'; mkdir $out; echo glTF > $out/model.glb; echo '{}' > $out/report.json");
  boot();
  get_ready();
  const auto id = scan();
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(job(id)->stages.back().name, "volume");
  EXPECT_EQ(*read_file(job(id)->model), "glTF\n");
}

TEST_F(Executor, AProcessThatCrashesFailsItsJobAndLeavesNothing) {
  execute("mkdir $out; echo half > $out/model.glb; kill -SEGV $$");
  boot();
  get_ready();
  const auto id = scan();
  expect_failed(id, ErrorCode::internal, "Segmentation fault");
  EXPECT_FALSE(fs::exists(fs::path(job(id)->folder) / "model.new"));
}

TEST_F(Executor, AProcessThatFailsSaysWhy) {
  execute("printf 'failed\\tsame_rest\\tthe object was not turned over\\n'; exit 7");
  boot();
  get_ready();
  expect_failed(scan(), ErrorCode::same_rest, "was not turned over");
}

TEST_F(Executor, AProcessWithoutAWordIsQuoted) {
  execute("echo 'it is raining' >&2; exit 3");
  boot();
  get_ready();
  expect_failed(scan(), ErrorCode::internal, "ended with 3: it is raining");
}

TEST_F(Executor, AProcessIsStoppedOnRequestWithAllItStartedAndLeavesNothing) {
  execute("mkdir $out; echo $$ > $out/pid; sleep 600");
  const auto calibration = read_calibration(options.jobs.calibration_file);
  ASSERT_TRUE(calibration) << calibration.error().message;
  const auto made = options.reconstructor({.calibration = *calibration, .folder = folder_});
  ASSERT_TRUE(made) << made.error().message;
  std::stop_source asked;
  const auto begun = folder_ / "model.new" / "pid";
  std::jthread impatient([&] {
    RealClock real;
    for (const auto by = Deadline::after(real, std::chrono::seconds(10)); !by.expired(real);) {
      if (fs::exists(begun) && fs::file_size(begun) > 0) break;
      real.sleep_for(std::chrono::milliseconds(1));
    }
    asked.request_stop();
  });
  const auto done = (*made)->finish(folder_ / "model", {asked.get_token(), {}});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::stopped);
  EXPECT_FALSE(fs::exists(folder_ / "model"));
  EXPECT_FALSE(fs::exists(folder_ / "model.new"));
}

}  // namespace
}  // namespace scanrig
