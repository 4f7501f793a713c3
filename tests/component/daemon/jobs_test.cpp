#include <gmock/gmock.h>

#include <array>

#include "core/files.h"
#include "tests/component/daemon/jobs_under_test.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using What = event::JobRequested::What;

TEST_F(Jobs, AnOrderIsAFolderBeforeItIsAnswered) {
  options.recipes["small"] = {.name = "small", .poses = 1, .views = 3};
  boot();
  get_ready();
  const auto first = ask(JobOrder{.recipe = "small", .part = "4711", .repeat = 2});
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(ScanFolder::open(folder_ / "jobs" / *first)->manifest().state, "queued");
  EXPECT_EQ(job_folders().size(), 2u);
  EXPECT_EQ(job(*first)->part, "4711");
  EXPECT_EQ(loop->snapshot()->queue.size(), 2u);
  EXPECT_EQ(ask(JobOrder{.recipe = "none"}).error().code, ErrorCode::not_found);

  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(*first, JobState::done));
  EXPECT_EQ(job(*first)->stored.size(), 3u) << "one pose of three views, as its recipe says";
  EXPECT_EQ(loop->snapshot()->queue.size(), 1u);
}

TEST_F(Jobs, TheQueueOutlivesTheDaemonInItsOrder) {
  boot();
  get_ready();
  const auto a = ask(JobOrder{.part = "a"}), b = ask(JobOrder{.part = "b"});
  ASSERT_TRUE(a && b);
  ASSERT_TRUE(ask_for(What::to_front, *b));
  EXPECT_THAT(loop->snapshot()->queue, ElementsAre(*b, *a));
  restart();
  EXPECT_THAT(loop->snapshot()->queue, ElementsAre(*b, *a));
  ASSERT_TRUE(ask_for(What::cancel, *b));
  EXPECT_EQ(job(*b)->state, JobState::cancelled);
  EXPECT_THAT(loop->snapshot()->queue, ElementsAre(*a));
}

TEST_F(Jobs, AReconstructionCanBeCancelledAndTheModelBeMadeLater) {
  Result<std::string> answer = fail(ErrorCode::internal, "not asked");
  log.at_finish = [&] { answer = ask_for(What::cancel, newest()->id); };
  boot();
  get_ready();
  scan_both_poses();
  const auto id = newest()->id;
  ASSERT_TRUE(wait_state(id, JobState::cancelled)) << to_string(job(id)->state);
  EXPECT_TRUE(answer) << answer.error().message;
  restart();
  EXPECT_EQ(job(id)->state, JobState::cancelled) << "it does not restart";
  EXPECT_EQ(job(id)->error->message, "cancelled on request");

  log.at_finish = [] {};
  ASSERT_TRUE(ask_for(What::reprocess, id));
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(ask_for(What::cancel, id).error().code, ErrorCode::refused) << "it has ended";
  restart();
  EXPECT_EQ(job(id)->state, JobState::done);
}

TEST_F(Jobs, AReconstructionWhoseCancellingCannotBeNotedDoesNotStandStill) {
  Result<std::string> answer;
  log.at_finish = [&] {
    const fs::path folder = newest()->folder;
    fs::create_directories(folder / "failure.json" / "in the way");
    answer = ask_for(What::cancel, newest()->id);
  };
  boot();
  get_ready();
  scan_both_poses();
  EXPECT_TRUE(wait_state(newest()->id, JobState::failed)) << to_string(newest()->state);
  EXPECT_FALSE(answer);
}

TEST_F(Jobs, AReconstructionThatWaitsForAnotherCanBeCancelledToo) {
  const auto [first, second] = two_models();
  const auto is_finish = [](const std::string& call) { return call == "finish"; };
  ASSERT_EQ(std::ranges::count_if(log.calls, is_finish), 2);

  log.at_finish = [this, next = second, asked = false]() mutable {
    if (std::exchange(asked, true)) return;
    EXPECT_TRUE(ask_for(What::reprocess, next));
    EXPECT_TRUE(ask_for(What::cancel, next));
  };
  ASSERT_TRUE(ask_for(What::reprocess, first));
  EXPECT_TRUE(wait_state(first, JobState::done));
  EXPECT_TRUE(wait_state(second, JobState::cancelled));
  shut_down();
  EXPECT_EQ(std::ranges::count_if(log.calls, is_finish), 3) << "no work is done on what was cancelled";
}

TEST_F(Jobs, AModelThatWillBeMadeAgainIsNotAskedForTwice) {
  const auto [first, second] = two_models();

  std::vector<Result<std::string>> begun, waiting;
  log.at_finish = [&, id = first, next = second] {
    if (!begun.empty()) return;
    begun.push_back(ask_for(What::reprocess, id));
    for (int i = 0; i < 2; ++i) waiting.push_back(ask_for(What::reprocess, next));
  };
  ASSERT_TRUE(ask_for(What::reprocess, first));
  EXPECT_TRUE(wait_state(first, JobState::done));
  EXPECT_TRUE(wait_state(second, JobState::done));
  ASSERT_EQ(waiting.size(), 2u);
  EXPECT_TRUE(waiting[0]);
  for (const auto& twice : {begun[0], waiting[1]}) {
    ASSERT_FALSE(twice);
    EXPECT_EQ(twice.error().code, ErrorCode::busy);
  }
  shut_down();
  EXPECT_EQ(std::ranges::count(log.calls, "finish"), 4);
}

TEST_F(Jobs, AnInterruptedScanGoesOnWhereItStopped) {
  boot();
  get_ready();
  const auto id = interrupted_after(2);
  EXPECT_TRUE(is_resumable(*job(id)));
  const auto before = rig.line.exposures;
  ASSERT_TRUE(ask_for(What::resume, id));
  finish(id);
  const auto scan = only_job();
  EXPECT_EQ(scan.manifest().poses[0].movement_checks.size(), 2u) << "before it went on, and after the last view";
  EXPECT_EQ(scan.manifest().poses[0].movement_checks[0].after_views, 2);
  EXPECT_LE(rig.line.exposures - before, 2 * (1 + 1 + 1 + 3 + 1)) << "no view that was there is taken again";
  expect_all_stored_views_readable(scan);
  EXPECT_FALSE(read_failure(scan.path())) << "why it was interrupted is history";
}

TEST_F(Jobs, AScanGoesOnAfterTheDaemonDiedToo) {
  options.jobs.config_sha256 = std::string(64, 'a');
  boot();
  get_ready();
  const auto id = interrupted_after(1);
  shut_down();
  options.jobs.config_sha256 = std::string(64, 'b');
  boot();
  get_ready();
  EXPECT_THAT(job(id)->config_sha256, ElementsAre(std::string(64, 'a')));
  EXPECT_TRUE(is_resumable(*job(id)));
  EXPECT_EQ(rig.turntable.moving, false);
  ASSERT_TRUE(ask_for(What::resume, id));
  finish(id);
  EXPECT_THAT(job(id)->config_sha256, ElementsAre(std::string(64, 'a'), std::string(64, 'b')));
  restart();
  EXPECT_THAT(job(id)->config_sha256, ElementsAre(std::string(64, 'a'), std::string(64, 'b')));
  EXPECT_THAT(log.calls, testing::IsSupersetOf({"view 0/0", "view 0/1", "view 0/2", "pose 0", "pose 1", "finish"}));
}

TEST_F(Jobs, AnObjectThatWasTouchedIsNotGoneOnWith) {
  boot();
  get_ready();
  const auto id = interrupted_after(2);
  look_at(40);
  ASSERT_TRUE(ask_for(What::resume, id));
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(id, JobState::interrupted));
  EXPECT_EQ(job(id)->error->code, ErrorCode::moved);
  EXPECT_FALSE(is_resumable(*job(id)));
  EXPECT_TRUE(fs::exists(job_folders()[0] / "pose1" / "movement00_left.png")) << "evidence";
  ASSERT_TRUE(wait_ready());
  EXPECT_EQ(ask_for(What::resume, id).error().code, ErrorCode::refused);
  ASSERT_TRUE(ask_for(What::cancel, id)) << "it can be ended";
  EXPECT_EQ(job(id)->state, JobState::cancelled);
  EXPECT_EQ(job(id)->stored.size(), 2u);
}

TEST_F(Jobs, AnObjectThatSlipsDuringThePoseIsNoticed) {
  boot();
  get_ready();
  rig.line.fires_before = 2 * 2;  // two views
  rig.line.at_fire = [this] { look_at(40); };
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([this] { return newest() != nullptr; }));
  EXPECT_TRUE(wait_state(newest()->id, JobState::failed));
  EXPECT_EQ(newest()->error->code, ErrorCode::moved);
  EXPECT_TRUE(wait_ready()) << "one bad part stops no line";
}

TEST_F(Jobs, APartNobodyTurnsOverIsParkedAndCanBeFinishedLater) {
  options.recipes["default"].flip_timeout = std::chrono::minutes(5);
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  const auto id = newest()->id;
  ASSERT_TRUE(wait_ready());
  EXPECT_TRUE(wait_state(id, JobState::interrupted));
  EXPECT_THAT(job(id)->error->message, HasSubstr("parked"));
  ASSERT_TRUE(ask_for(What::resume, id));
  rig.panel.press(&PanelInputs::start);
  EXPECT_TRUE(wait_state(id, JobState::done));
  EXPECT_TRUE(only_job().manifest().poses[1].complete);
}

TEST_F(Jobs, AJobThatDoesNotFitOnTheDiskIsNotBegun) {
  options.jobs.reserve_bytes = std::uintmax_t{1} << 60;
  boot();
  get_ready();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([this] { return newest() && loop->snapshot()->machine == MachineState::ready; }));
  EXPECT_THAT(loop->snapshot()->cause, HasSubstr("GiB"));
  EXPECT_EQ(loop->snapshot()->queue.size(), 1u);
  clock.sleep_for(std::chrono::minutes(1));
  EXPECT_EQ(rig.line.exposures, 0);
}

TEST_F(Jobs, ALineRunsItsQueueByPartsAndByTheFlipSignal) {
  options.recipes["line"] = {.name = "line", .views = 3, .flip_by_signal = true, .start_on_part = true};
  boot();
  get_ready();
  ASSERT_TRUE(ask(JobOrder{.recipe = "line", .repeat = 2}));
  const auto ids = loop->snapshot()->queue;
  const auto turn_over = [&] {
    ASSERT_TRUE(wait_flip());
    rig.panel.set(&PanelInputs::flipped, true);
    rig.panel.set(&PanelInputs::flipped, false);
  };
  rig.panel.press(&PanelInputs::start);
  turn_over();
  EXPECT_TRUE(wait_state(ids[0], JobState::done));
  rig.panel.set(&PanelInputs::part_present, false);
  rig.panel.set(&PanelInputs::part_present, true);
  turn_over();
  EXPECT_TRUE(wait_state(ids[1], JobState::done));
  EXPECT_EQ(loop->snapshot()->machine, MachineState::ready);
}

TEST_F(Jobs, ALineWaitsForItsProjectorToBeWarmAndAPersonNeedNot) {
  options.recipes["line"] = {.name = "line", .poses = 1, .views = 3, .start_on_part = true};
  options.warm_up = std::chrono::seconds(600);
  const auto begin = clock.now();
  boot();
  get_ready();
  ASSERT_TRUE(ask(JobOrder{.recipe = "line", .repeat = 2}));
  const auto ids = loop->snapshot()->queue;
  const auto begun = [&](const std::string& id) { return loop->snapshot()->job == id; };
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(clock_waits_for([&] { return begun(ids[0]); }));
  ASSERT_TRUE(wait_state(ids[0], JobState::done));
  EXPECT_LT(clock.now() - begin, options.warm_up) << "a cold projector is no matter to who presses Start";

  // A projector that was away restarts its warm-up.
  const auto set_absent = [&](bool absent) {
    {
      const std::lock_guard guard(rig.line.mutex);
      rig.line.projector_absent = absent;
    }
    clock.sleep_for(std::chrono::seconds(10));
  };
  set_absent(true);
  const auto back = clock.now();
  set_absent(false);
  rig.panel.set(&PanelInputs::part_present, false);
  rig.panel.set(&PanelInputs::part_present, true);
  EXPECT_THAT(loop->snapshot()->next_action, testing::HasSubstr("Projector warming up: 5"));
  EXPECT_TRUE(wait_state(ids[1], JobState::done));
  const std::lock_guard guard(rig.turntable.mutex);
  const auto first_move = *std::ranges::find_if(rig.turntable.move_starts, [&](auto at) { return at > back; });
  EXPECT_GE(first_move - back, options.warm_up);
  EXPECT_LT(first_move - back, options.warm_up + std::chrono::seconds(15));
}

TEST_F(Jobs, AnEndedJobIsBundledExportedAndRemoved) {
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  const auto id = newest()->id;
  const auto file = folder_ / "bundle.tar.gz";
  EXPECT_EQ(ask(event::JobRequested{.what = What::bundle, .job = id, .path = file}).value_or("no"), file.string());
  EXPECT_GT(fs::file_size(file), 1000u);
  const auto job_log = read_file(fs::path(job(id)->folder) / "log.jsonl");
  ASSERT_TRUE(job_log) << "the log of the job";
  EXPECT_THAT(*job_log, testing::AllOf(testing::HasSubstr("Stored, taken at"), testing::HasSubstr("\"pose\":1")));
  EXPECT_EQ(ask(event::JobRequested{.what = What::bundle, .job = id, .path = file}).error().code, ErrorCode::exists);
  EXPECT_EQ(ask(event::JobRequested{.what = What::bundle, .job = id, .path = "here.tar.gz"}).error().code,
            ErrorCode::invalid_input);
  EXPECT_EQ(ask(event::JobRequested{.what = What::bundle, .job = id, .path = folder_ / "no" / "b.tar.gz"}).error().code,
            ErrorCode::io);
  EXPECT_EQ(ask(event::JobRequested{.what = What::bundle, .job = "none", .path = file}).error().code,
            ErrorCode::not_found);
  ASSERT_TRUE(ask_for(What::set_exported, id));
  EXPECT_TRUE(job(id)->exported);
  ASSERT_TRUE(ask_for(What::remove, id));
  EXPECT_EQ(job(id), nullptr);
  EXPECT_THAT(job_folders(), IsEmpty());
  EXPECT_EQ(ask_for(What::remove, id).error().code, ErrorCode::not_found);
}

TEST_F(Jobs, RetentionRemovesWhatIsExportedWhenTheNextJobBegins) {
  options.retention.keep_bytes = 1;
  boot();
  get_ready();
  scan_both_poses();
  ASSERT_TRUE(wait_pass());
  const auto id = newest()->id;
  ASSERT_TRUE(ask_for(What::set_exported, id));
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_flip());
  ASSERT_TRUE(clock_waits_for([&] { return !job(id); }));
  EXPECT_EQ(job_folders().size(), 1u) << "the one being scanned";
}

}  // namespace
}  // namespace scanrig
