#include "daemon/station/operator_message.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

JobInfo job_in(JobState state) {
  JobInfo job;
  job.state = state;
  job.recipe.views = 4;
  return job;
}

TEST(JobWords, EveryStateSaysWhatBecomesOfTheJobAndWhatToDo) {
  for (int state = 0; state <= static_cast<int>(JobState::cancelled); ++state) {
    EXPECT_FALSE(describe(job_in(static_cast<JobState>(state))).sentence.empty()) << state;
    EXPECT_FALSE(describe(job_in(static_cast<JobState>(state))).next_action.empty()) << state;
  }
}

TEST(JobWords, AScanTellsHowFarItsPoseIs) {
  auto j = job_in(JobState::scanning);
  j.complete = 1;
  for (int view = 0; view < 4; ++view) j.stored.push_back({.pose = 0, .view = view});
  j.stored.push_back({.pose = 1, .view = 0});
  EXPECT_EQ(describe(j).sentence, "Pose 2 of 2: 1 of 4 views stored.");
  EXPECT_EQ(describe(j).next_action, "Do not move the part.");
}

TEST(JobWords, TheFlipIsAskedForAsTheStationAsks) {
  auto j = job_in(JobState::waiting_for_flip);
  j.complete = 1;
  EXPECT_EQ(describe(j).sentence, "Pose 1 of 2 is complete.");
  EXPECT_EQ(describe(j).next_action, "Turn the part over so that its underside faces the cameras, then press Start.");
  j.recipe.flip_by_signal = true;
  EXPECT_EQ(describe(j).next_action, "Wait: the automation turns the part over.");
}

TEST(JobWords, AModelInTheMakingTellsItsStage) {
  auto j = job_in(JobState::reconstructing);
  EXPECT_EQ(describe(j).sentence, "Reconstructing.");
  j.stages = {{"range", 1.0}, {"volume", 0.25}};
  EXPECT_EQ(describe(j).sentence, "Reconstructing: volume, 25 %.");
}

TEST(JobWords, AModelBeyondTheLimitsSaysWhatMayBeDone) {
  auto j = job_in(JobState::done);
  j.passed = true;
  EXPECT_EQ(describe(j).sentence, "The model is ready.");
  j.remarks = {"Left camera moved by 0.06 px: clamp it, calibrate again."};
  EXPECT_EQ(describe(j).sentence, "The model is ready. Left camera moved by 0.06 px: clamp it, calibrate again.");
  j.remarks.clear();
  j.passed = false;
  j.error = Error{ErrorCode::below_limits, "0.8 of it is measured, 0.9 are asked for"};
  EXPECT_EQ(describe(j).sentence, "Model outside the recipe's limits: 0.8 of it is measured, 0.9 are asked for.");
  EXPECT_NE(describe(j).next_action.find("limits of recipe default"), std::string::npos);
}

TEST(JobWords, AFailureSaysWhetherItsImagesAreOfUse) {
  auto j = job_in(JobState::failed);
  j.complete = 2;
  j.error = Error{ErrorCode::no_overlap, "the poses do not fit"};
  EXPECT_EQ(describe(j).sentence, "Failed: the poses do not fit.");
  EXPECT_EQ(describe(j).next_action, "Reprocess with other options, or scan the part again.");
  j.error->code = ErrorCode::same_rest;
  EXPECT_EQ(describe(j).next_action, "Scan the part again.") << "no option turns the object over";
  j.quarantined = true;
  EXPECT_EQ(describe(j).next_action, "Send a bundle to support or reprocess.");
}

TEST(JobWords, AnInterruptedJobSaysWhereItsObjectBelongs) {
  auto j = job_in(JobState::interrupted);
  j.error = Error{ErrorCode::stopped, "the e-stop was pressed"};
  EXPECT_EQ(describe(j).sentence, "Interrupted: the e-stop was pressed.");
  j.movement_checks = {{.unmoved = false}};
  EXPECT_EQ(describe(j).next_action, "Cancel the job, then scan the part again.") << "it moved";
  j.movement_checks.clear();
  EXPECT_EQ(describe(j).next_action, "Put its part on the table. Resume the job, then press Start.");
  j.stored = {{.pose = 0, .view = 0}};
  EXPECT_EQ(describe(j).next_action, "Do not move the part. Resume the job, then press Start.");
  j.complete = 1;
  EXPECT_EQ(describe(j).next_action, "Put its part on the table, turned over. Resume the job, then press Start.");
}

}  // namespace
}  // namespace scanrig
