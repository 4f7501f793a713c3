#include "pipeline/registration/refine_pose.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig {
namespace {

using testing::RigModel;

/// The work piece laid on its side (x = -30 becomes the bottom) and turned.
Transform laid_down() {
  Transform t = Transform::Identity();
  t.linear() = (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  t.translation() = Eigen::Vector3d(12, 30, -7);
  return t;
}

struct TwoPoses {
  std::vector<View> first, second;
  Transform pose1_from_pose2 = laid_down().inverse();
};

const TwoPoses& two_poses() {
  static const TwoPoses poses = [] {
    RigModel rig{.width = 320, .height = 240, .focal_px = 1130};
    rig.noise_mm = 0.01;
    return TwoPoses{testing::turn_around(testing::workpiece(), 8, rig, 1),
                    testing::turn_around(testing::moved(testing::workpiece(), laid_down()), 8, rig, 2)};
  }();
  return poses;
}

/// `t` disturbed by `angle_deg` about some axis through the middle of the object and by `shift_mm`.
Transform off_by(const Transform& t, double angle_deg, double shift_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
  const Eigen::Translation3d middle(0, 25, 0);
  const Eigen::Vector3d turn = to_radians(angle_deg) * direction();
  return middle * small_motion(turn, shift_mm * direction()) * middle.inverse() * t;
}

void expect_near(const Transform& got, const Transform& truth, double angle_deg, double shift_mm) {
  EXPECT_LT(to_degrees(rotation_angle(got.linear().transpose() * truth.linear())), angle_deg);
  const Eigen::Vector3d middle = truth.inverse() * Eigen::Vector3d(0, 25, 0);
  EXPECT_LT((got * middle - truth * middle).norm(), shift_mm);
}

TEST(RefinePose, ReachesAHundredthFromEightDegreesAndFiveMillimetres) {
  const TwoPoses& scan = two_poses();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const auto refined = refine_pose(scan.first, scan.second, off_by(scan.pose1_from_pose2, 8, 5, seed), {}, Context{});
    ASSERT_TRUE(refined) << refined.error().message;
    expect_near(refined->pose1_from_pose2, scan.pose1_from_pose2, 0.01, 0.01);
    EXPECT_GT(refined->overlap, 0.4);
    EXPECT_LT(refined->median_mm, 0.02);
    EXPECT_LT(refined->condition, 1e3);
  }
}

TEST(RefinePose, ReportsTheCertaintyOfTheMotion) {
  const auto cylinder = testing::upright_cylinder({0, 0, 0}, 20, 60);
  const auto views = testing::turn_around(cylinder, 8, {.width = 240, .height = 180, .focal_px = 850});
  const auto turned = refine_pose(views, views, rot_y(0.05), {}, Context{});
  ASSERT_TRUE(turned) << turned.error().message;
  EXPECT_GT(turned->condition, 1e4);
}

TEST(RefinePose, GivesTheSameBitsOnAnyNumberOfThreads) {
  const TwoPoses& scan = two_poses();
  Result<RefinedPose> one;
  Result<RefinedPose> many;
  const Transform start = off_by(scan.pose1_from_pose2, 4, 2, 3);
  with_threads(1, [&] { one = refine_pose(scan.first, scan.second, start, {}, Context{}); });
  with_threads(3, [&] { many = refine_pose(scan.first, scan.second, start, {}, Context{}); });
  ASSERT_TRUE(one && many);
  EXPECT_EQ(0, std::memcmp(one->pose1_from_pose2.data(), many->pose1_from_pose2.data(), 16 * sizeof(double)));
}

TEST(RefinePose, ReportsAnEmptyPose) {
  const TwoPoses& scan = two_poses();
  const auto refined = refine_pose(scan.first, {}, Transform::Identity(), {}, Context{});
  ASSERT_FALSE(refined);
  EXPECT_EQ(refined.error().code, ErrorCode::degenerate);
}

TEST(RefinePose, ReportsSurfacesThatDoNotMeet) {
  const TwoPoses& scan = two_poses();
  const Transform far = Eigen::Translation3d(0, 400, 0) * scan.pose1_from_pose2;
  const auto refined = refine_pose(scan.first, scan.second, far, {}, Context{});
  ASSERT_FALSE(refined);
  EXPECT_EQ(refined.error().code, ErrorCode::no_overlap);
}

TEST(RefinePose, StopsOnRequest) {
  const TwoPoses& scan = two_poses();
  std::stop_source source;
  source.request_stop();
  const auto refined = refine_pose(scan.first, scan.second, scan.pose1_from_pose2, {}, {source.get_token(), {}});
  ASSERT_FALSE(refined);
  EXPECT_EQ(refined.error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
