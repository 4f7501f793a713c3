#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/storage/pose_choices.h"
#include "tests/component/daemon/jobs_under_test.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using What = event::JobRequested::What;

/// Finished scans that are given another pose, and failed ones of which a person picks how the poses lie.
class MorePoses : public Jobs {};

TEST_F(MorePoses, AFinishedScanIsGivenAnotherPose) {
  boot();
  get_ready();
  scan_both_poses();
  const auto id = newest()->id;
  ASSERT_TRUE(wait_state(id, JobState::done));
  ASSERT_TRUE(wait_ready());
  const auto queued = ask(JobOrder{.part = "another"});
  ASSERT_TRUE(ask_for(What::add_pose, id));
  EXPECT_EQ(job(id)->state, JobState::queued);
  EXPECT_EQ(job(id)->recipe.poses, 3);
  EXPECT_THAT(loop->snapshot()->queue, ElementsAre(id, *queued)) << "what lies on the table next";
  EXPECT_TRUE(fs::exists(folder_ / "jobs" / id / "model/model.glb")) << "the old model stays meanwhile";
  EXPECT_EQ(ask_for(What::add_pose, id).error().code, ErrorCode::refused);
  restart();
  EXPECT_EQ(job(id)->state, JobState::queued);

  const auto views = job(id)->stored.size();
  rig.panel.press(&PanelInputs::start);
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(job(id)->complete, 3);
  EXPECT_EQ(job(id)->stored.size(), views + 3) << "only the third pose was scanned";
  const auto scan = ScanFolder::open(folder_ / "jobs" / id);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->manifest().poses.size(), 3U);
}

TEST_F(MorePoses, AScanWhoseOtherPoseIsCancelledIsAsItWas) {
  boot();
  get_ready();
  scan_both_poses();
  const auto id = newest()->id;
  ASSERT_TRUE(wait_state(id, JobState::done));
  ASSERT_TRUE(wait_ready());
  const auto before = *job(id);
  ASSERT_TRUE(ask_for(What::add_pose, id));
  ASSERT_TRUE(ask_for(What::cancel, id));
  EXPECT_EQ(job(id)->state, JobState::done);
  EXPECT_EQ(job(id)->recipe, before.recipe);
  EXPECT_EQ(job(id)->model, before.model);

  // Once more, with a view of it taken.
  ASSERT_TRUE(ask_for(What::add_pose, id));
  EXPECT_EQ(interrupted_after(1), id);
  EXPECT_EQ(job(id)->stored.size(), before.stored.size() + 1);
  ASSERT_TRUE(ask_for(What::cancel, id));
  EXPECT_EQ(job(id)->state, JobState::done);
  EXPECT_EQ(job(id)->stored.size(), before.stored.size());
  EXPECT_FALSE(job(id)->error);
  restart();
  EXPECT_EQ(job(id)->state, JobState::done);
  EXPECT_EQ(job(id)->recipe, before.recipe);
  ASSERT_TRUE(ask_for(What::reprocess, id));
  EXPECT_TRUE(wait_state(id, JobState::done));
}

TEST_F(MorePoses, OnlyAFinishedScanIsGivenAnotherPose) {
  boot();
  get_ready();
  const auto id = interrupted_after(1);
  const auto refused = ask_for(What::add_pose, id);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("0 of 2 poses: only a finished scan can be given another pose"));
  EXPECT_EQ(ask_for(What::choose, id).error().code, ErrorCode::refused);
  EXPECT_EQ(job(id)->state, JobState::interrupted);
  EXPECT_EQ(job(id)->recipe.poses, 2);
}

/// Pose 2 fits in two ways: the operator picks one, and every later model is of that.
TEST_F(MorePoses, OfTheWaysInWhichPose2FitsOneIsPicked) {
  const auto find_two_ways = [this] {
    const fs::path folder = newest()->folder;
    if (const auto known = read_choices(folder); known && known->picked > 0) return;
    ASSERT_TRUE(write_choices(folder, std::array{PoseChoice{.sentence = "as it lies", .png = "an image"},
                                                 PoseChoice{.sentence = "end for end"}}));
    const std::lock_guard guard(log.mutex);
    log.answer_to_finish = fail(ErrorCode::ambiguous, "several motions fit");
  };
  log.at_finish = find_two_ways;
  boot();
  get_ready();
  scan_both_poses();
  const auto id = newest()->id;
  ASSERT_TRUE(wait_state(id, JobState::failed));
  const std::vector<JobChoice> both = {{"as it lies", "choices/choice1.png"}, {"end for end", ""}};
  EXPECT_EQ(job(id)->choices, both);
  restart();
  EXPECT_EQ(job(id)->choices, both);
  EXPECT_EQ(job(id)->picked, 0);

  const auto pick = [&](int number) {
    return ask(event::JobRequested{.what = What::choose, .job = id, .number = number});
  };
  EXPECT_EQ(pick(3).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(pick(0).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(job(id)->state, JobState::failed);
  log.answer_to_finish = {};
  ASSERT_TRUE(pick(2));
  ASSERT_TRUE(wait_state(id, JobState::done));
  EXPECT_EQ(job(id)->picked, 2);
  EXPECT_EQ(read_choices(job(id)->folder)->picked, 2);
  restart();
  EXPECT_EQ(job(id)->picked, 2);
}

}  // namespace
}  // namespace scanrig
