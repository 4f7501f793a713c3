#include "daemon/station/job_lifecycle.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

class Jobs : public testing::Test {
 protected:
  void tell(const Event& event) { update(table, event); }
  void begin() {
    tell(event::JobUpdated{std::make_shared<const JobInfo>(JobInfo{.id = "a", .folder = "/jobs/a"})});
    tell(event::JobStarted{"a", 0, 0});
  }
  const JobInfo& job() const { return *table.at("a"); }
  JobTable table;
};

TEST_F(Jobs, AJobAppearsWhenItsFolderIsThere) {
  tell(event::ViewStored{{"a", 0, 0}, 0.0});
  EXPECT_TRUE(table.empty());
  tell(event::JobUpdated{std::make_shared<const JobInfo>(JobInfo{.id = "a", .folder = "/jobs/a"})});
  EXPECT_EQ(job().state, JobState::queued);
  EXPECT_EQ(job().folder, "/jobs/a");
  tell(event::JobStarted{"a", 0, 0});
  EXPECT_EQ(job().state, JobState::scanning);
}

TEST_F(Jobs, EntriesAlreadyHandedOutDoNotChange) {
  begin();
  const auto held = table.at("a");
  tell(event::ViewStored{{"a", 0, 0}, 0.5, {{ErrorCode::timeout, "left camera: no frame"}}});
  EXPECT_TRUE(held->stored.empty());
  ASSERT_EQ(job().stored.size(), 1u);
  EXPECT_EQ(job().stored[0].measured_deg, 0.5);
  ASSERT_EQ(job().stored[0].retake_reasons.size(), 1u);
  EXPECT_EQ(job().stored[0].retake_reasons[0].message, "left camera: no frame");
}

TEST_F(Jobs, AJobGoesThroughFlipAndReconstructionToDone) {
  begin();
  tell(event::PoseStored{"a", 0});
  EXPECT_EQ(job().state, JobState::waiting_for_flip);
  tell(event::ViewStored{{"a", 1, 0}, 0.0});
  EXPECT_EQ(job().state, JobState::scanning);
  tell(event::PoseStored{"a", 1});
  EXPECT_EQ(job().state, JobState::reconstructing);
  tell(event::StageProgress{"a", "volume", 0.25});
  tell(event::StageProgress{"a", "texture", 0.1});
  tell(event::StageProgress{"a", "volume", 1.0});
  ASSERT_EQ(job().stages.size(), 2u);
  EXPECT_EQ(job().stages[0].name, "volume");
  EXPECT_EQ(job().stages[0].fraction, 1.0);
  tell(event::ModelReady{"a", "/jobs/a/model/model.glb", "/jobs/a/model/report.json"});
  EXPECT_EQ(job().state, JobState::done);
  EXPECT_EQ(job().report, "/jobs/a/model/report.json");
}

TEST_F(Jobs, AReconstructionThatFailsEarlyFailsTheJobAfterItsLastView) {
  begin();
  tell(event::ReconstructionFailed{"a", {ErrorCode::degenerate, "nothing seen"}});
  EXPECT_EQ(job().state, JobState::scanning);
  tell(event::PoseStored{"a", 1});
  EXPECT_EQ(job().state, JobState::failed);
  EXPECT_EQ(job().error->message, "nothing seen");
}

TEST_F(Jobs, AModelBeyondTheLimitsIsDoneAndDoesNotPass) {
  begin();
  tell(event::ModelReady{"a", "m", "r", Error{ErrorCode::below_limits, "80 % was measured"}});
  EXPECT_EQ(job().state, JobState::done);
  EXPECT_EQ(job().passed, false);
  EXPECT_EQ(job().error->message, "80 % was measured");
}

TEST_F(Jobs, MovementCheckAreKept) {
  begin();
  tell(event::MovementChecked{"a", {.pose = 0, .shift_px = 3.0, .unmoved = false}});
  ASSERT_EQ(job().movement_checks.size(), 1u);
  EXPECT_EQ(job().movement_checks[0].shift_px, 3.0);
}

TEST_F(Jobs, ARemovedJobIsGone) {
  begin();
  tell(event::JobRemoved{"a"});
  EXPECT_TRUE(table.empty());
}

TEST_F(Jobs, AJobIsClosedForWhoeverLooksAndWhatTheDiskSaysLateDoesNotOpenIt) {
  begin();
  tell(event::ViewStored{{"a", 0, 0}, 0.0});
  close(table, {"a", JobState::interrupted, {ErrorCode::io, "the disk does not answer"}});
  EXPECT_EQ(job().state, JobState::interrupted);
  EXPECT_EQ(job().error->message, "the disk does not answer");
  EXPECT_TRUE(is_resumable(job()));
  tell(event::ViewStored{{"a", 0, 1}, 0.0});
  tell(event::JobStarted{"a", 0, 0});
  EXPECT_EQ(job().state, JobState::interrupted);
  EXPECT_EQ(job().error->message, "the disk does not answer");
  EXPECT_EQ(job().stored.size(), 2u) << "it is there all the same";

  tell(event::MovementChecked{"a", {.unmoved = false}});
  close(table, {"a", JobState::interrupted, {ErrorCode::moved, "moved"}});
  EXPECT_FALSE(is_resumable(job()));
}

TEST_F(Jobs, AnEndIsToldOnce) {
  begin();
  EXPECT_FALSE(update(table, event::ReconstructionFailed{"a", {ErrorCode::degenerate, "nothing seen"}}));
  const auto ended = close(table, {"a", JobState::failed, {ErrorCode::degenerate, "nothing seen"}});
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->job, "a");
  EXPECT_EQ(ended->state, JobState::failed);
  EXPECT_FALSE(update(table, event::JobClosed{"a", JobState::failed, {ErrorCode::degenerate, "nothing seen"}}));

  auto again = job();
  again.state = JobState::reconstructing;
  EXPECT_FALSE(update(table, event::JobUpdated{std::make_shared<const JobInfo>(again)}));
  const auto made = update(table, event::ModelReady{"a", "m", "r"});
  ASSERT_TRUE(made) << "what is reprocessed ends again";
  EXPECT_EQ(made->state, JobState::done);
  EXPECT_FALSE(update(table, event::JobUpdated{std::make_shared<const JobInfo>(job())}));
}

TEST_F(Jobs, AClosedJobSaysWhy) {
  begin();
  tell(event::JobClosed{"a", JobState::cancelled, {ErrorCode::stopped, "Stop was pressed"}});
  EXPECT_EQ(job().state, JobState::cancelled);
  EXPECT_EQ(job().error->message, "Stop was pressed");
}

}  // namespace
}  // namespace scanrig
