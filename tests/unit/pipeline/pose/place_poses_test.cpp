#include "pipeline/pose/place_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/pipeline/pose/posed_scan.h"

namespace scanrig {
namespace {

using ::testing::HasSubstr;
using testing::PosedScan;
using testing::scan;
using testing::Solid;
using testing::turn;

/// One pose of an object, as range images and closed solid.
struct OnePose {
  std::vector<View> views;
  Mesh solid;
  Transform model_from_pose = Transform::Identity();
};

OnePose lay(const Solid& solid, const Eigen::Matrix3d& turned) {
  PosedScan s = scan(solid, turned);
  return {std::move(s.views2), std::move(s.solid2), s.pose1_from_pose2};
}

Eigen::Matrix3d on_its_side() { return turn(40, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitZ()); }
Eigen::Matrix3d on_its_back() { return turn(-25, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitX()); }

const OnePose& upright() {
  static const OnePose pose = lay(testing::workpiece(), turn(10, Eigen::Vector3d::UnitY()));
  return pose;
}
const OnePose& side() {
  static const OnePose pose = lay(testing::workpiece(), on_its_side());
  return pose;
}
const OnePose& back() {
  static const OnePose pose = lay(testing::workpiece(), on_its_back());
  return pose;
}
const OnePose& other_object() {
  static const OnePose pose =
      lay(testing::together({testing::ball({0, 30, 0}, 30), testing::block({-10, 0, -45}, {10, 20, 0})}),
          turn(0, Eigen::Vector3d::UnitY()));
  return pose;
}

Result<PlacedPoses> place(const std::vector<const OnePose*>& poses, const Context& context = {}) {
  std::vector<PoseInput> inputs;
  for (const OnePose* pose : poses) inputs.push_back({pose->solid, pose->views});
  return place_poses(inputs, {}, context);
}

void expect_placed(const PlacedPoses& placed, const std::vector<const OnePose*>& poses, std::size_t first,
                   std::size_t pose) {
  ASSERT_TRUE(placed.model_from_pose[pose]) << pose;
  const Transform truth = poses[first]->model_from_pose.inverse() * poses[pose]->model_from_pose;
  EXPECT_LT(to_degrees(rotation_angle(placed.model_from_pose[pose]->linear().transpose() * truth.linear())), 0.2);
  EXPECT_LT((placed.model_from_pose[pose]->translation() - truth.translation()).norm(), 0.3);
}

TEST(PlacePoses, ThreePosesAndWhatFollowsIsNotSearched) {
  const std::vector<const OnePose*> poses = {&upright(), &side(), &back()};
  const auto placed = place(poses);
  ASSERT_TRUE(placed) << placed.error().message;
  for (const std::size_t pose : {1U, 2U}) expect_placed(*placed, poses, 0, pose);
  EXPECT_TRUE(placed->left_out.empty());
  ASSERT_EQ(placed->pairs.size(), 3U);
  EXPECT_EQ(placed->pairs[0].verdict, PosePair::Verdict::agrees);
  EXPECT_EQ(placed->pairs[1].verdict, PosePair::Verdict::agrees);
  EXPECT_EQ(placed->pairs[2].verdict, PosePair::Verdict::follows);
  EXPECT_EQ(placed->searches, 2);
  EXPECT_FALSE(placed->pairs[2].estimate);
}

TEST(PlacePoses, APoseOfAnotherObjectIsLeftOutByName) {
  const std::vector<const OnePose*> poses = {&upright(), &other_object(), &back()};
  const auto placed = place(poses);
  ASSERT_TRUE(placed) << placed.error().message;
  expect_placed(*placed, poses, 0, 2);
  EXPECT_FALSE(placed->model_from_pose[1]);
  ASSERT_EQ(placed->left_out.size(), 1U);
  EXPECT_EQ(placed->left_out[0].pose, 1U);
  EXPECT_THAT(placed->left_out[0].sentence, HasSubstr("Pose 2 is not used"));
}

TEST(PlacePoses, TheFirstPoseMayBeTheOtherObject) {
  const std::vector<const OnePose*> poses = {&other_object(), &side(), &back()};
  const auto placed = place(poses);
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_FALSE(placed->model_from_pose[0]);
  expect_placed(*placed, poses, 1, 2);
}

TEST(PlacePoses, APoseThatWasOnlyTurnedIsUsedBesideOneThatWasTurnedOver) {
  const OnePose again = lay(testing::workpiece(), turn(70, Eigen::Vector3d::UnitY()));
  const std::vector<const OnePose*> poses = {&upright(), &again, &side()};
  const auto placed = place(poses);
  ASSERT_TRUE(placed) << placed.error().message;
  for (const std::size_t pose : {1U, 2U}) expect_placed(*placed, poses, 0, pose);
  EXPECT_EQ(placed->pairs[0].verdict, PosePair::Verdict::same_rest);
  const auto all_alike = place({&upright(), &again, &upright()});
  ASSERT_FALSE(all_alike);
  EXPECT_EQ(all_alike.error().code, ErrorCode::same_rest);
}

TEST(PlacePoses, RefusesNinePoses) {
  const auto placed = place(std::vector<const OnePose*>(9, &upright()));
  ASSERT_FALSE(placed);
  EXPECT_EQ(placed.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(placed.error().message, HasSubstr("2 to 8 poses"));
}

TEST(PlacePoses, GivesTheSameBitsOnAnyNumberOfThreads) {
  Result<PlacedPoses> one, many;
  with_threads(1, [&] { one = place({&upright(), &side(), &back()}); });
  with_threads(3, [&] { many = place({&upright(), &side(), &back()}); });
  ASSERT_TRUE(one && many);
  for (const std::size_t pose : {1U, 2U}) {
    EXPECT_EQ(one->model_from_pose[pose]->matrix(), many->model_from_pose[pose]->matrix());
  }
}

}  // namespace
}  // namespace scanrig
