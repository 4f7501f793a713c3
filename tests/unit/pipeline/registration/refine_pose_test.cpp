#include "pipeline/registration/refine_pose.h"

#include <gtest/gtest.h>

#include "pipeline/registration/pose_equations.h"
#include "pipeline/registration/pose_uncertainty.h"
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

void expect_near(const Transform& got, const Transform& truth, double angle_deg, double shift_mm) {
  EXPECT_LT(to_degrees(rotation_angle(got.linear().transpose() * truth.linear())), angle_deg);
  const Eigen::Vector3d middle = truth.inverse() * Eigen::Vector3d(0, 25, 0);
  EXPECT_LT((got * middle - truth * middle).norm(), shift_mm);
}

TEST(RefinePose, ReachesAHundredthFromEightDegreesAndFiveMillimetres) {
  const TwoPoses& scan = two_poses();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const auto refined =
        refine_pose(scan.first, scan.second, testing::off_by(scan.pose1_from_pose2, 8, 5, seed), {}, Context{});
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
  // Of a body of revolution the turn about its axis is open, and nothing else.
  const PrincipalSigmas turn = principal_sigmas(turned->covariance.topLeftCorner<3, 3>());
  EXPECT_GT(turn.sigma[0], 30.0 * turn.sigma[1]);
  EXPECT_GT(std::abs(turn.directions.col(0).y()), 0.99);
}

/// Weight that a contact on the table gets beside surfaces of which `facing_up` do so, as a share of theirs.
double contact_weight(double facing_up, bool is_flat) {
  RefineOptions options;
  options.contacts = {{.normal_in_pose1 = Eigen::Vector3d::UnitY(), .is_flat = is_flat}};
  MotionEquations e;
  e.normal.diagonal().tail<3>() = Eigen::Vector3d(1.0 - facing_up, facing_up, 0.0);
  add_contacts(options, Transform::Identity(), e);
  return e.normal(4, 4) - facing_up;
}

TEST(RefinePose, FlatContactsMakeUpForSurfaceThatIsMissing) {
  const double slight = RefineOptions{}.contact_share;
  EXPECT_NEAR(contact_weight(0.0, false), slight, 1e-9);
  EXPECT_NEAR(contact_weight(0.0, true), 0.05, 1e-9);
  EXPECT_NEAR(contact_weight(0.03, true), 0.02, 1e-9);
  EXPECT_NEAR(contact_weight(0.4, true), slight, 1e-9);  // surfaces that were measured by both hold it better
}

/// Largest component of the motion's error in its own sigma, over the principal directions.
double in_sigmas(const RefinedPose& refined, const Transform& truth) {
  const Transform off = refined.pose1_from_pose2 * truth.inverse();
  const Eigen::AngleAxisd turn(off.linear());
  const auto worst = [](const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
    const PrincipalSigmas known = principal_sigmas(covariance);
    return (known.directions.transpose() * error).cwiseAbs().cwiseQuotient(known.sigma).maxCoeff();
  };
  return std::max(worst(turn.angle() * turn.axis(), refined.covariance.topLeftCorner<3, 3>()),
                  worst(off * refined.centre - refined.centre, refined.covariance.bottomRightCorner<3, 3>()));
}

TEST(RefinePose, KnowsHowWellTheMotionIsKnown) {
  RigModel rig{.width = 240, .height = 180, .focal_px = 850};
  rig.noise_mm = 0.02;
  const Transform truth = laid_down().inverse();
  double sum = 0.0;
  constexpr unsigned kTrials = 6;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const auto first = testing::turn_around(testing::workpiece(), 6, rig, 10 + 2 * trial);
    const auto second = testing::turn_around(testing::moved(testing::workpiece(), laid_down()), 6, rig, 11 + 2 * trial);
    const auto refined = refine_pose(first, second, testing::off_by(truth, 1, 1, trial), {}, Context{});
    ASSERT_TRUE(refined) << refined.error().message;
    const double sigmas = in_sigmas(*refined, truth);
    EXPECT_LT(sigmas, 4.0) << trial;
    sum += sigmas;
  }
  EXPECT_GT(sum / kTrials, 0.3);  // nor far too unsure
}

TEST(RefinePose, IsNoSurerThanTheAxisOfTheTurntable) {
  const TwoPoses& scan = two_poses();
  RefineOptions options;
  const auto views_alone = refine_pose(scan.first, scan.second, scan.pose1_from_pose2, options, Context{});
  options.axis = {1e-4, 0.01};
  const auto refined = refine_pose(scan.first, scan.second, scan.pose1_from_pose2, options, Context{});
  ASSERT_TRUE(views_alone && refined);
  EXPECT_EQ(refined->pose1_from_pose2.matrix(), views_alone->pose1_from_pose2.matrix());
  const auto of_axis = axis_covariance(refined->pose1_from_pose2, refined->centre, options.axis);
  EXPECT_GT(of_axis.norm(), 1e-6);
  EXPECT_TRUE(refined->covariance.isApprox(views_alone->covariance + of_axis, 1e-9));
}

TEST(RefinePose, GivesTheSameBitsOnAnyNumberOfThreads) {
  const TwoPoses& scan = two_poses();
  Result<RefinedPose> one;
  Result<RefinedPose> many;
  const Transform start = testing::off_by(scan.pose1_from_pose2, 4, 2, 3);
  with_threads(1, [&] { one = refine_pose(scan.first, scan.second, start, {}, Context{}); });
  with_threads(3, [&] { many = refine_pose(scan.first, scan.second, start, {}, Context{}); });
  ASSERT_TRUE(one && many);
  EXPECT_EQ(one->pose1_from_pose2.matrix(), many->pose1_from_pose2.matrix());
  EXPECT_EQ(one->covariance, many->covariance);
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
