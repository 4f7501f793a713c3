#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/unit/pipeline/pose/posed_scan.h"
#include "tests/unit/pipeline/pose/turned_solids.h"

namespace scanrig {
namespace {

using testing::PosedScan;
using testing::Solid;
using testing::turn;
using Group = Symmetry::Group;

const Eigen::Matrix3d kLaidDown = turn(25, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitX());
const Eigen::Matrix3d kTurnedOnTheTable = turn(65, Eigen::Vector3d::UnitY());

/// Farthest distance of the model's surface from the object: pose 2's range images placed in pose 1.
double surface_error(const PosedScan& scan, const Solid& solid, const Transform& pose1_from_pose2) {
  double error = 0.0;
  for (const View& view : scan.views2) {
    const Transform pose1_from_camera = pose1_from_pose2 * view.range.camera_from_pose.inverse();
    for (int row = 0; row < view.range.depth.rows; ++row) {
      for (int column = 0; column < view.range.depth.cols; ++column) {
        const float depth = view.range.depth(row, column);
        if (std::isnan(depth)) continue;
        error =
            std::max(error, std::abs(solid(pose1_from_camera * view.range.projection.unproject(column, row, depth))));
      }
    }
  }
  return error;
}

/// A model with this symmetry, as good as noise of 0.01 mm allows.
void expect_model(const Result<PoseEstimate>& estimate, const PosedScan& scan, const Solid& solid, Group group,
                  int fold, std::size_t motions) {
  ASSERT_TRUE(estimate) << estimate.error().message;
  EXPECT_STREQ(to_string(estimate->symmetry.group), to_string(group)) << describe(estimate->symmetry);
  EXPECT_EQ(estimate->symmetry.fold, fold);
  EXPECT_EQ(estimate->symmetry.motions, motions);
  EXPECT_LT(surface_error(scan, solid, estimate->pose1_from_pose2), 0.12);
}

TEST(Symmetry, OfABoxIsThreeHalfTurns) {
  const Solid box = testing::block({-30, 0, -20}, {30, 30, 20});
  const PosedScan scan = testing::scan(box, kLaidDown);
  expect_model(scan.estimate(), scan, box, Group::dihedral, 2, 4);
}

TEST(Symmetry, OfACubeIsAllItsTwentyFourPositions) {
  const Solid cube = testing::block({-20, 0, -20}, {20, 40, 20});
  const PosedScan scan = testing::scan(cube, kLaidDown);
  expect_model(scan.estimate(), scan, cube, Group::cubic, 4, 24);
}

TEST(Symmetry, OfAHexagonalPrismIsDihedral) {
  const Solid prism = testing::prism(6, 20, 50);
  const PosedScan scan = testing::scan(prism, kLaidDown);
  expect_model(scan.estimate(), scan, prism, Group::dihedral, 6, 12);
}

TEST(Symmetry, OfABottleIsAnyTurnAboutItsAxis) {
  const PosedScan scan = testing::scan(testing::bottle(), kLaidDown);
  const auto estimate = scan.estimate();
  expect_model(estimate, scan, testing::bottle(), Group::axial, 0, 0);
  ASSERT_TRUE(estimate);
  EXPECT_FALSE(estimate->symmetry.two_sided);
  EXPECT_GT(estimate->symmetry.axis.y(), 0.9999);
  EXPECT_LT(std::hypot(estimate->symmetry.point.x(), estimate->symmetry.point.z()), 0.05);
}

TEST(Symmetry, OfACylinderHasTwoSides) {
  const Solid cylinder = testing::upright_cylinder({0, 0, 0}, 20, 50);
  const PosedScan scan = testing::scan(cylinder, kLaidDown);
  const auto estimate = scan.estimate();
  expect_model(estimate, scan, cylinder, Group::axial, 0, 0);
  ASSERT_TRUE(estimate);
  EXPECT_TRUE(estimate->symmetry.two_sided);
}

/// A ball shows nothing of how it was turned.
TEST(Symmetry, OfABallThatWasNotTurnedOverStillGivesItsModel) {
  const Solid ball = testing::ball({0, 25, 0}, 25);
  const PosedScan scan = testing::scan(ball, kTurnedOnTheTable);
  const auto estimate = scan.estimate();
  ASSERT_TRUE(estimate) << estimate.error().message;
  EXPECT_TRUE(estimate->symmetry.is_continuous()) << describe(estimate->symmetry);
  EXPECT_LT(surface_error(scan, ball, estimate->pose1_from_pose2), 0.12);
}

/// A cap of 0.08 mm, eight times the noise of a pixel, on a side of a box that both poses see.
TEST(Symmetry, IsNotClaimedOfABoxWithALowBump) {
  const Solid box = testing::block({-30, 0, -20}, {30, 30, 20});
  const Solid bumped = testing::with_bump(box, {30, 17, 6}, Eigen::Vector3d::UnitX(), 0.08, 12);
  const PosedScan scan = testing::scan(bumped, kLaidDown);
  const auto estimate = scan.estimate();
  if (!estimate) {
    EXPECT_EQ(estimate.error().code, ErrorCode::ambiguous) << estimate.error().message;
    return;
  }
  EXPECT_LT(rotation_angle(estimate->pose1_from_pose2.linear().transpose() * scan.pose1_from_pose2.linear()),
            to_radians(0.3));
  EXPECT_LT(surface_error(scan, bumped, estimate->pose1_from_pose2), 0.12);
}

/// Too small for three patches, but wherever it is not, a view looked through it.
TEST(Symmetry, IsNotClaimedOfACylinderWithALug) {
  const Solid lug = testing::together({testing::upright_cylinder({0, 0, 0}, 16, 36), testing::ball({17, 18, 0}, 3.3)});
  const PosedScan scan = testing::scan(lug, kLaidDown);
  const SelfComparison one_pose(scan.views1, 3, 0.02, 0.005, {}, {});
  for (const double degrees : {30.0, 90.0, 180.0}) {
    Transform about_the_axis = Transform::Identity();
    about_the_axis.linear() = turn(degrees, Eigen::Vector3d::UnitY());
    EXPECT_FALSE(one_pose.symmetric_near(about_the_axis)) << degrees;
  }
}

/// What one side of a cylinder shows fits after small turns by any angle. These are no group, and the other side is not
/// known to be like it.
TEST(Symmetry, IsNotClaimedOfACylinderSeenFromOneSide) {
  PosedScan scan = testing::scan(testing::upright_cylinder({0, 0, 0}, 20, 50), kLaidDown);
  scan.views1.resize(2);
  const SelfComparison one_side(scan.views1, 3, 0.02, 0.005, {}, {});
  std::vector<Transform> turns;
  for (const double degrees : {25.0, 41.0}) {
    turns.push_back(Transform(turn(degrees, Eigen::Vector3d::UnitY())));
    EXPECT_TRUE(one_side.symmetric_near(turns.back()));
  }
  EXPECT_FALSE(find_symmetry(one_side, turns, {}));
}

TEST(Symmetry, OfABottleThatOnlyTurnedOnTheTableIsNoReasonToTakeItForTurnedOver) {
  const auto estimate = testing::scan(testing::bottle(), kTurnedOnTheTable).estimate();
  ASSERT_FALSE(estimate);
  EXPECT_EQ(estimate.error().code, ErrorCode::same_rest) << estimate.error().message;
}

/// Its hollow is on top twice.
TEST(Symmetry, OfACupThatStandsTwiceDoesNot) {
  const Solid cup = testing::lathed({{0, 0}, {22, 0}, {22, 50}, {18, 50}, {18, 5}, {0, 5}});
  const auto estimate = testing::scan(cup, kTurnedOnTheTable).estimate();
  ASSERT_FALSE(estimate);
  EXPECT_EQ(estimate.error().code, ErrorCode::same_rest) << estimate.error().message;
}

const Eigen::Matrix3d kUpsideDown = turn(33, Eigen::Vector3d::UnitY()) * turn(180, Eigen::Vector3d::UnitX());

/// What is lost where the object stands on the table, as beside every edge.
void lose_foot(std::vector<View>& views, double height_mm) {
  for (View& view : views) {
    RangeImage& range = view.range;
    const Transform pose_from_camera = range.camera_from_pose.inverse();
    for (int row = 0; row < range.depth.rows; ++row) {
      for (int column = 0; column < range.depth.cols; ++column) {
        float& depth = range.depth(row, column);
        if (std::isnan(depth)) continue;
        const Eigen::Vector3d point = pose_from_camera * range.projection.unproject(column, row, depth);
        if (point.y() < height_mm) depth = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
}

void expect_prism_turned_upside_down(int sides, double height_mm, double lost_foot_mm) {
  const Solid prism = testing::prism(sides, 20, height_mm);
  PosedScan scan = testing::scan(prism, kUpsideDown);
  lose_foot(scan.views1, lost_foot_mm);
  lose_foot(scan.views2, lost_foot_mm);
  const auto estimate = scan.estimate();
  expect_model(estimate, scan, prism, Group::dihedral, sides, 2 * static_cast<std::size_t>(sides));
  ASSERT_TRUE(estimate);
  EXPECT_TRUE(turns_over(estimate->pose1_from_pose2));
}

/// One end lies on the table in either pose, so no surface holds the height of the turn end for end.
TEST(Symmetry, OfAPrismUpsideDownIsNoReasonToTakeItForLeftAsItStood) { expect_prism_turned_upside_down(3, 40, 2.5); }

/// So many turns on the table fit that they fill the field: the turn end for end is found by symmetry.
TEST(Symmetry, OfAPrismOfEightUpsideDownIsNoReasonToTakeItForLeftAsItStood) {
  expect_prism_turned_upside_down(8, 50, 1.0);
}

TEST(Symmetry, OfACylinderUpsideDownIsNoReasonToTakeItForLeftAsItStood) {
  const Solid cylinder = testing::upright_cylinder({0, 0, 0}, 20, 50);
  const PosedScan scan = testing::scan(cylinder, kUpsideDown);
  expect_model(scan.estimate(), scan, cylinder, Group::axial, 0, 0);
}

/// Rolled from one face onto the next it shows one long face less than if it had been left: that alone is no reason.
TEST(Symmetry, OfAPrismThatWasRolledIsNoReasonToTakeItForLeftAsItStood) {
  Transform lying_from_upright(Eigen::Translation3d(-30, 16, 0));
  lying_from_upright.linear() = turn(-90, Eigen::Vector3d::UnitZ());
  const Solid lying = testing::moved(testing::prism(3, 16, 60), lying_from_upright);
  const PosedScan scan = testing::scan(lying, turn(25, Eigen::Vector3d::UnitY()) * turn(120, Eigen::Vector3d::UnitX()));
  const auto estimate = scan.estimate();
  expect_model(estimate, scan, lying, Group::dihedral, 3, 6);
  ASSERT_TRUE(estimate);
  EXPECT_TRUE(turns_over(estimate->pose1_from_pose2));
}

/// The sides fit four ways, and nothing holds their height: only at the right one do the feet and the ball, which one
/// pose sees each, fit into what the other pose looked through.
TEST(Symmetry, OfTheSidesIsBrokenByEndsThatOnePoseSeesEach) {
  const PosedScan scan = testing::scan(
      testing::together({testing::block({-20, 5, -20}, {20, 45, 20}), testing::ball({10, 45, 4}, 5),
                         testing::block({-14, 0, 6}, {-4, 6, 14}), testing::block({-14, 0, -14}, {-8, 6, -8}),
                         testing::block({12, 0, -4}, {18, 6, 4})}),
      kUpsideDown);
  const auto estimate = scan.estimate();
  ASSERT_TRUE(estimate) << estimate.error().message;
  EXPECT_LT(rotation_angle(estimate->pose1_from_pose2.linear().transpose() * scan.pose1_from_pose2.linear()),
            to_radians(0.1));
}

/// Dents on top are seen in pose 1 alone, those below in pose 2 alone, and the sides that both see fit four ways.
TEST(Symmetry, DoesNotHideThatBothEndsDiffer) {
  const Solid block = testing::block({-20, 0, -20}, {20, 40, 20});
  const Solid dents = testing::together({testing::ball({8, 44, 4}, 11), testing::block({-16, -1, 2}, {-2, 7, 16}),
                                         testing::block({-14, -1, -14}, {-8, 5, -8})});
  const Solid both_ends = [=](const Eigen::Vector3d& p) { return std::max(block(p), -dents(p)); };
  const PosedScan scan = testing::scan(both_ends, kUpsideDown);
  std::vector<Candidate> fitting;
  const auto estimate = estimate_pose({scan.solid1, scan.views1}, {scan.solid2, scan.views2}, {}, {}, fitting);
  ASSERT_FALSE(estimate) << describe(estimate->symmetry);
  EXPECT_EQ(estimate.error().code, ErrorCode::ambiguous) << estimate.error().message;

  // A person sees which one is right, and any of them may be it.
  ASSERT_GE(fitting.size(), 2U);
  int right = 0;
  for (const Candidate& candidate : fitting) {
    PoseOptions options;
    options.picked = candidate.pose1_from_pose2;
    const auto picked = scan.estimate(options);
    ASSERT_TRUE(picked) << picked.error().message;
    EXPECT_TRUE(picked->is_picked);
    EXPECT_TRUE(picked->pose1_from_pose2.isApprox(candidate.pose1_from_pose2, 1e-9));
    const Eigen::Matrix3d off = scan.pose1_from_pose2.linear().transpose() * picked->pose1_from_pose2.linear();
    right += rotation_angle(off) < to_radians(0.5) ? 1 : 0;
  }
  EXPECT_EQ(right, 1);
  PoseOptions none_of_them;
  none_of_them.picked = scan.pose1_from_pose2 * Eigen::AngleAxisd(to_radians(45), Eigen::Vector3d::UnitY());
  EXPECT_EQ(scan.estimate(none_of_them).error().code, ErrorCode::ambiguous);
}

/// Where the measurements decide, no person does.
TEST(Symmetry, APickDoesNotOverruleWhatIsMeasured) {
  const Solid solid = testing::together({testing::block({-25, 0, -15}, {25, 30, 15}), testing::ball({18, 30, 6}, 9),
                                         testing::block({-25, 0, 15}, {-10, 12, 24})});
  const PosedScan scan = testing::scan(solid, kLaidDown);
  PoseOptions options;
  options.picked = scan.pose1_from_pose2 * Eigen::AngleAxisd(to_radians(180), Eigen::Vector3d::UnitY());
  const auto estimate = scan.estimate(options);
  ASSERT_TRUE(estimate) << estimate.error().message;
  EXPECT_FALSE(estimate->is_picked);
  EXPECT_LT(rotation_angle(estimate->pose1_from_pose2.linear().transpose() * scan.pose1_from_pose2.linear()),
            to_radians(0.5));
}

TEST(Symmetry, IsSaidInOneSentence) {
  Symmetry symmetry;
  symmetry.group = Group::dihedral;
  symmetry.fold = 6;
  EXPECT_EQ(describe(symmetry),
            "the part is the same after each turn by 60 deg about one axis, and turned end for end");
  symmetry.of = Symmetry::Of::pose2;
  symmetry.group = Group::axial;
  EXPECT_EQ(describe(symmetry), "what pose 2 shows of the part is the same after every turn about one axis");
}

TEST(Symmetry, GivesTheSameBitsOnAnyNumberOfThreads) {
  const PosedScan scan = testing::scan(testing::prism(6, 20, 50), kLaidDown);
  Result<PoseEstimate> one, many;
  with_threads(1, [&] { one = scan.estimate(); });
  with_threads(3, [&] { many = scan.estimate(); });
  ASSERT_TRUE(one && many);
  EXPECT_TRUE(one->pose1_from_pose2.matrix() == many->pose1_from_pose2.matrix());
  EXPECT_TRUE(one->symmetry.axis == many->symmetry.axis);
}

}  // namespace
}  // namespace scanrig
