#include "pipeline/registration/refine_poses.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig {
namespace {

using testing::RigModel;

Transform lying(double about_x, double about_z, const Eigen::Vector3d& shift) {
  Transform t = Transform::Identity();
  t.linear() = (Eigen::AngleAxisd(to_radians(about_x), Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(to_radians(about_z), Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  t.translation() = shift;
  return t;
}

/// The work piece in three poses; the third is noisier.
struct ThreePoses {
  std::vector<std::vector<View>> views;
  std::vector<Transform> model_from_pose;
  [[nodiscard]] std::vector<std::span<const View>> spans() const { return {views.begin(), views.end()}; }
};

const ThreePoses& three_poses() {
  static const ThreePoses poses = [] {
    RigModel rig{.width = 288, .height = 216, .focal_px = 1000};
    rig.noise_mm = 0.01;
    ThreePoses made;
    const std::vector<Transform> pose_from_model = {Transform::Identity(), lying(0, 90, {12, 30, -7}),
                                                    lying(90, 0, {-5, 30, 4})};
    for (std::size_t i = 0; i < pose_from_model.size(); ++i) {
      if (i == 2) rig.noise_mm = 0.03;
      made.views.push_back(testing::turn_around(testing::moved(testing::workpiece(), pose_from_model[i]), 8, rig,
                                                1 + static_cast<unsigned>(i)));
      made.model_from_pose.push_back(pose_from_model[i].inverse());
    }
    return made;
  }();
  return poses;
}

std::vector<Transform> starts(double angle_deg, double shift_mm) {
  std::vector<Transform> made = three_poses().model_from_pose;
  for (std::size_t i = 1; i < made.size(); ++i)
    made[i] = testing::off_by(made[i], angle_deg, shift_mm, 3 * static_cast<unsigned>(i));
  return made;
}

double error_mm(const Transform& got, const Transform& truth) {
  double worst = 0.0;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(30, 25, 0), Eigen::Vector3d(-30, 0, 20), Eigen::Vector3d(0, 50, -20)}) {
    worst = std::max(worst, (got * truth.inverse() * p - p).norm());
  }
  return worst;
}

const std::vector<PoseLink> kAll = {{0, 1}, {0, 2}, {1, 2}};
const std::vector<PoseLink> kChain = {{0, 1}, {1, 2}};

TEST(RefinePoses, ReachesAHundredthOfAMillimetreInAllPosesAtOnce) {
  const ThreePoses& scan = three_poses();
  const auto refined = refine_poses(scan.spans(), starts(5, 3), kAll, {}, Context{});
  ASSERT_TRUE(refined) << refined.error().message;
  EXPECT_EQ(refined->model_from_pose[0].matrix(), scan.model_from_pose[0].matrix());
  EXPECT_LT(error_mm(refined->model_from_pose[1], scan.model_from_pose[1]), 0.01);
  EXPECT_LT(error_mm(refined->model_from_pose[2], scan.model_from_pose[2]), 0.02);
  ASSERT_EQ(refined->links.size(), 3U);
  for (const LinkFit& link : refined->links) EXPECT_GT(link.overlap, 0.2);
  EXPECT_GT(refined->links[2].median_mm, 1.3 * refined->links[0].median_mm);
}

/// Two poses are the same problem as in refine_pose().
TEST(RefinePoses, OfTwoPosesIsRefinePose) {
  const ThreePoses& scan = three_poses();
  RefineOptions options;
  options.axis = {1e-4, 0.01};
  const auto spans = scan.spans();
  const Transform start = testing::off_by(scan.model_from_pose[1], 2, 1, 5);
  const auto pair = refine_pose(spans[0], spans[1], start, options, Context{});
  const std::vector<Transform> both = {Transform::Identity(), start};
  const auto joint = refine_poses(std::span(spans).first(2), both, std::vector<PoseLink>{{0, 1}}, options, Context{});
  ASSERT_TRUE(pair && joint);
  EXPECT_LT(error_mm(joint->model_from_pose[1], pair->pose1_from_pose2), 1e-4);
  EXPECT_TRUE(joint->covariance[1].isApprox(pair->covariance, 0.02));
  EXPECT_NEAR(joint->links[0].median_mm, pair->median_mm, 1e-5);
}

/// A pose that others tie to the first ones is known as well as these ties say, and no better.
TEST(RefinePoses, AFurtherLinkMakesAPoseMoreCertain) {
  const ThreePoses& scan = three_poses();
  const auto chain = refine_poses(scan.spans(), starts(1, 1), kChain, {}, Context{});
  const auto all = refine_poses(scan.spans(), starts(1, 1), kAll, {}, Context{});
  ASSERT_TRUE(chain && all);
  EXPECT_LT(error_mm(chain->model_from_pose[2], scan.model_from_pose[2]), 0.03);
  EXPECT_LT(all->covariance[2].diagonal().tail<3>().sum(), chain->covariance[2].diagonal().tail<3>().sum());
  EXPECT_GT(chain->covariance[2].diagonal().tail<3>().sum(), chain->covariance[1].diagonal().tail<3>().sum());
  EXPECT_EQ(all->covariance[0].norm(), 0.0);
}

TEST(RefinePoses, ErrorsStayWithinTheirSigmas) {
  const ThreePoses& scan = three_poses();
  const auto refined = refine_poses(scan.spans(), starts(1, 1), kAll, {}, Context{});
  ASSERT_TRUE(refined);
  for (const std::size_t pose : {1U, 2U}) {
    const Transform off = refined->model_from_pose[pose] * scan.model_from_pose[pose].inverse();
    const Eigen::Vector3d shift = off * refined->centre - refined->centre;
    const PrincipalSigmas known = principal_sigmas(refined->covariance[pose].bottomRightCorner<3, 3>());
    EXPECT_LT((known.directions.transpose() * shift).cwiseAbs().cwiseQuotient(known.sigma).maxCoeff(), 4.0) << pose;
    EXPECT_LT(known.sigma[0], 0.02);
  }
}

TEST(RefinePoses, GivesTheSameBitsOnAnyNumberOfThreads) {
  const ThreePoses& scan = three_poses();
  Result<RefinedPoses> one, many;
  with_threads(1, [&] { one = refine_poses(scan.spans(), starts(3, 2), kAll, {}, Context{}); });
  with_threads(3, [&] { many = refine_poses(scan.spans(), starts(3, 2), kAll, {}, Context{}); });
  ASSERT_TRUE(one && many);
  for (const std::size_t pose : {1U, 2U}) {
    EXPECT_EQ(one->model_from_pose[pose].matrix(), many->model_from_pose[pose].matrix());
    EXPECT_EQ(one->covariance[pose], many->covariance[pose]);
  }
}

TEST(RefinePoses, RefusesLinksThatDoNotJoinAllPosesAndPosesThatDoNotMeet) {
  const ThreePoses& scan = three_poses();
  const auto open = refine_poses(scan.spans(), starts(0, 0), std::vector<PoseLink>{{0, 1}}, {}, Context{});
  ASSERT_FALSE(open);
  EXPECT_EQ(open.error().code, ErrorCode::invalid_input);
  std::vector<Transform> far = starts(0, 0);
  far[2] = Eigen::Translation3d(0, 400, 0) * far[2];
  const auto apart = refine_poses(scan.spans(), far, kAll, {}, Context{});
  ASSERT_FALSE(apart);
  EXPECT_EQ(apart.error().code, ErrorCode::no_overlap);
}

}  // namespace
}  // namespace scanrig
