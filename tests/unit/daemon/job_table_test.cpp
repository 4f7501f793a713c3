#include "daemon/station/job_table.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

class Jobs : public testing::Test {
 protected:
  void tell(const Event& event) { update(table, event, 2, 8); }
  const JobInfo& job() const { return *table.at("a"); }
  JobTable table;
};

TEST_F(Jobs, AJobAppearsWhenItsFolderIsThere) {
  tell(event::ViewStored{{"a", 0, 0}, 0.0, 0});
  EXPECT_TRUE(table.empty());
  tell(event::JobCreated{"a", "/jobs/a"});
  EXPECT_EQ(job().state, JobState::scanning);
  EXPECT_EQ(job().folder, "/jobs/a");
}

TEST_F(Jobs, EntriesAlreadyHandedOutDoNotChange) {
  tell(event::JobCreated{"a", "/jobs/a"});
  const auto held = table.at("a");
  tell(event::ViewStored{{"a", 0, 0}, 0.5, 1});
  EXPECT_TRUE(held->stored.empty());
  ASSERT_EQ(job().stored.size(), 1u);
  EXPECT_EQ(job().stored[0].measured_deg, 0.5);
  EXPECT_EQ(job().stored[0].redone, 1);
}

TEST_F(Jobs, AJobGoesThroughFlipAndReconstructionToDone) {
  tell(event::JobCreated{"a", "/jobs/a"});
  tell(event::PoseStored{"a", 0});
  EXPECT_EQ(job().state, JobState::waiting_for_flip);
  tell(event::ViewStored{{"a", 1, 0}, 0.0, 0});
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
  tell(event::JobCreated{"a", "/jobs/a"});
  tell(event::ReconstructionFailed{"a", {ErrorCode::degenerate, "nothing seen"}});
  EXPECT_EQ(job().state, JobState::scanning);
  tell(event::PoseStored{"a", 1});
  EXPECT_EQ(job().state, JobState::failed);
  EXPECT_EQ(job().error->message, "nothing seen");
}

TEST_F(Jobs, AClosedJobSaysWhy) {
  tell(event::JobCreated{"a", "/jobs/a"});
  tell(event::JobClosed{"a", JobState::cancelled, {ErrorCode::stopped, "Stop was pressed"}});
  EXPECT_EQ(job().state, JobState::cancelled);
  EXPECT_EQ(job().error->message, "Stop was pressed");
}

}  // namespace
}  // namespace scanrig
