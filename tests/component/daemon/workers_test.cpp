#include <gmock/gmock.h>

#include <condition_variable>
#include <mutex>
#include <stdexcept>

#include "daemon/jobs/housekeeping_thread.h"
#include "daemon/jobs/reconstruction_thread.h"
#include "tests/component/daemon/fake_reconstructor.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using What = event::JobRequested::What;

/// Single threads of the daemon over real folders; the test is the control loop.
class Workers : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
    auto opened = JobStore::open({.root = folder_ / "jobs", .calibration_file = folder_ / "calibration.json"});
    ASSERT_TRUE(opened) << opened.error().message;
    store.emplace(std::move(*opened));
  }
  /// A scanned folder of one pose with two views in this state, listed by the station as `state`.
  void make_job(const std::string& id, const std::string& written, JobState state, bool exported = false) {
    auto info = store->create(id, {.recipe = {.poses = 1, .views = 2}, .exported = exported});
    ASSERT_TRUE(info) << info.error().message;
    auto scan = ScanFolder::open(store->folder(id));
    for (int view = 0; view < 2; ++view) {
      ASSERT_TRUE(scan->add_view(0, {.index = view}, scan_samples::raw_view(view)));
    }
    ASSERT_TRUE(scan->complete_pose(0, written));
    info->state = state;
    table[id] = std::make_shared<const JobInfo>(std::move(*info));
  }
  void tell(Event event) {
    const std::lock_guard guard(mutex);
    if (const auto* removed = std::get_if<event::JobRemoved>(&event)) gone.push_back(removed->job);
    events.push_back(std::move(event));
    changed.notify_all();
  }
  /// Waits for the first event of this kind.
  template <class Kind>
  std::optional<Kind> wait_for() {
    std::unique_lock lock(mutex);
    std::optional<Kind> found;
    changed.wait_for(lock, std::chrono::minutes(1), [&] {
      for (const auto& event : events) {
        if (const auto* kind = std::get_if<Kind>(&event); kind && !found) found = *kind;
      }
      return found.has_value();
    });
    events.clear();
    return found;
  }

  /// The whole work on "job", to its model.
  void rebuild(const Recipe& recipe, fakes::ReconstructionLog& log) {
    ReconstructionThread reconstruction(
        clock, [&](const ReconstructionTask&) { return std::make_unique<fakes::FakeReconstructor>(log); },
        [&](Event event) { tell(std::move(event)); });
    reconstruction.rebuild("job", store->folder("job"), recipe, {});
    std::unique_lock lock(mutex);
    changed.wait_for(lock, std::chrono::minutes(1), [&] {
      return std::ranges::any_of(events, [](const Event& e) { return std::holds_alternative<event::ModelReady>(e); });
    });
  }

  RealClock clock;
  std::optional<JobStore> store;
  JobTable table;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Event> events;
  std::vector<std::string> gone;
};

TEST_F(Workers, RetentionLooksAtWhatHasEndedOnly) {
  make_job("a-kept", "cancelled", JobState::cancelled);
  make_job("b-exported", "cancelled", JobState::cancelled, true);
  make_job("c-scanned-again", "scanning", JobState::scanning, true);
  make_job("d-scanned", "scanning", JobState::scanning);
  make_job("e-turned", "waiting_for_flip", JobState::waiting_for_flip);
  {
    HousekeepingThread housekeeping(
        clock, *store, {.keep_bytes = 1}, [&] { return table; }, [&](Event event) { tell(std::move(event)); });
    housekeeping.sweep();
    housekeeping.post({.what = What::remove, .job = "none", .request_id = 1});
    ASSERT_TRUE(wait_for<event::RequestDone>()) << "the sweep came before";
  }
  EXPECT_THAT(gone, ElementsAre("b-exported")) << "a-kept was not exported";
}

TEST_F(Workers, WhatWaitsForAModelIsNotRemoved) {
  make_job("job", "scanned", JobState::reconstructing);
  ASSERT_TRUE(create_directories_synced(model_folder(store->folder("job"))));
  scan_samples::write_text(report_file(store->folder("job")), "{}");  // of an older model
  HousekeepingThread housekeeping(
      clock, *store, {}, [&] { return table; }, [&](Event event) { tell(std::move(event)); });
  housekeeping.post({.what = What::remove, .job = "job", .request_id = 1});
  const auto answer = wait_for<event::RequestDone>();
  ASSERT_TRUE(answer);
  ASSERT_FALSE(answer->result);
  EXPECT_EQ(answer->result.error().code, ErrorCode::busy);
}

TEST_F(Workers, HousekeepingOutlivesWhatIsThrown) {
  make_job("job", "cancelled", JobState::cancelled);
  int throws = 2;
  const auto jobs = [&] {
    if (throws-- > 0) throw std::runtime_error("out of the blue");
    return table;
  };
  HousekeepingThread housekeeping(clock, *store, {.keep_bytes = 1}, jobs, [&](Event event) { tell(std::move(event)); });
  housekeeping.sweep();
  housekeeping.post({.what = What::remove, .job = "job", .request_id = 1});
  const auto answer = wait_for<event::RequestDone>();
  ASSERT_TRUE(answer);
  ASSERT_FALSE(answer->result);
  EXPECT_THAT(answer->result.error().message, HasSubstr("out of the blue"));
  housekeeping.post({.what = What::remove, .job = "job", .request_id = 2});
  const auto removed = wait_for<event::JobRemoved>();
  ASSERT_TRUE(removed);
  EXPECT_FALSE(fs::exists(store->folder("job")));
}

TEST_F(Workers, ReconstructionOutlivesWhatIsThrownBesideIt) {
  make_job("job", "scanned", JobState::reconstructing);
  fakes::ReconstructionLog log;
  int until_thrown = 1;  // the second report of progress comes when the first view is done
  const auto tell_or_throw = [&](Event event) {
    const bool progress = std::holds_alternative<event::StageProgress>(event);
    if (progress && until_thrown-- == 0) throw std::runtime_error("out of the blue");
    tell(std::move(event));
  };
  const Recipe recipe{.poses = 1, .views = 2};
  ReconstructionThread reconstruction(
      clock, [&](const ReconstructionTask&) { return std::make_unique<fakes::FakeReconstructor>(log); }, tell_or_throw);
  reconstruction.rebuild("job", store->folder("job"), recipe, {});
  const auto failed = wait_for<event::ReconstructionFailed>();
  ASSERT_TRUE(failed);
  EXPECT_THAT(failed->error.message, HasSubstr("out of the blue"));
  reconstruction.rebuild("job", store->folder("job"), recipe, {});
  EXPECT_TRUE(wait_for<event::ModelReady>());
}

using Lists = std::vector<std::vector<std::string>>;

Lists lists_of(const std::vector<Event>& events) {
  Lists lists;
  for (const auto& event : events) {
    if (const auto* meshes = std::get_if<event::LiveMeshes>(&event)) lists.push_back(meshes->names);
  }
  return lists;
}

TEST_F(Workers, WhatAScanShowsSoFarIsListedAndGoneWithItsEnd) {
  make_job("job", "scanned", JobState::reconstructing);
  const auto live = store->folder("job") / "live";
  fakes::ReconstructionLog log;
  std::string shown;
  log.at_finish = [&] { shown = read_file(live / "pose1.glb").value_or("nothing"); };
  rebuild({.poses = 2, .views = 2}, log);
  EXPECT_THAT(lists_of(events), ElementsAre(ElementsAre("pose1_view00"), ElementsAre("pose1_view00", "pose1_view01"),
                                            ElementsAre("pose1"), testing::IsEmpty()));
  EXPECT_EQ(shown, "pose so far");
  EXPECT_FALSE(fs::exists(live));
}

TEST_F(Workers, HowThePartCanLieNextIsToldWithImagesAndForgottenWithTheEnd) {
  make_job("job", "scanned", JobState::reconstructing);
  const auto live = store->folder("job") / "live";
  fakes::ReconstructionLog log;
  std::string image;
  log.at_finish = [&] { image = read_file(live / rest_image(1)).value_or("nothing"); };
  rebuild({.poses = 2, .views = 2}, log);
  std::vector<std::vector<SuggestedRest>> told;
  for (const auto& event : events) {
    if (const auto* one = std::get_if<event::RestsSuggested>(&event)) told.push_back(one->rests);
  }
  ASSERT_EQ(told.size(), 2U) << "after pose 1, none after the last, and that they are gone";
  ASSERT_EQ(told[0].size(), 2U);
  EXPECT_EQ(told[0][0].sentence, "Lay it on its back.");
  EXPECT_TRUE(told[0][0].has_image);
  EXPECT_FALSE(told[0][1].has_image);
  EXPECT_TRUE(told[1].empty());
  EXPECT_EQ(image, "an image");
}

TEST_F(Workers, APoseIsClosedWithItsLastViewWhateverTheMovementCheckWillSay) {
  auto info = store->create("job", {.recipe = {.poses = 1, .views = 2}, .exported = false});
  ASSERT_TRUE(info) << info.error().message;
  auto scan = ScanFolder::open(store->folder("job"));
  for (int view = 0; view < 2; ++view) {
    ASSERT_TRUE(scan->add_view(0, {.index = view}, scan_samples::raw_view(view)));
  }
  fakes::ReconstructionLog log;
  const auto prepared = [&] {
    const std::lock_guard guard(log.mutex);
    return log.prepared;
  };
  const auto attempts = [&] { return read_attempt_record(store->folder("job")).ended_by_death; };
  {
    ReconstructionThread reconstruction(
        clock, [&](const ReconstructionTask&) { return std::make_unique<fakes::FakeReconstructor>(log); },
        [&](Event event) { tell(std::move(event)); });
    reconstruction.begin("job", *scan, {.poses = 1, .views = 2});
    const auto end = clock.now() + std::chrono::minutes(1);
    while (prepared() == 0 && clock.now() < end) clock.sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(prepared(), 1);
    reconstruction.finish_pose("job", 0);
    reconstruction.abandon("job");  // something has moved
  }
  EXPECT_THAT(log.calls, ElementsAre("view 0/0", "view 0/1", "pose 0")) << "once, and no model";
  EXPECT_EQ(attempts(), 0) << "the mark is gone with the job";
}

TEST_F(Workers, ThePoseAfterWhichTheModelComesIsNotShown) {
  make_job("job", "scanned", JobState::reconstructing);
  fakes::ReconstructionLog log;
  rebuild({.poses = 1, .views = 2}, log);
  EXPECT_EQ(lists_of(events), (Lists{{"pose1_view00"}, {"pose1_view00", "pose1_view01"}, {}}));
}

}  // namespace
}  // namespace scanrig
