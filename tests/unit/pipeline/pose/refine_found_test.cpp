#include "pipeline/pose/refine_found.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/pose/flat_contacts.h"
#include "tests/unit/pipeline/pose/posed_scan.h"
#include "tests/unit/pipeline/pose/turned_solids.h"

namespace scanrig {
namespace {

using testing::PosedScan;
using testing::Solid;
using testing::turn;

const Eigen::Matrix3d kUpsideDown = turn(33, Eigen::Vector3d::UnitY()) * turn(180, Eigen::Vector3d::UnitX());

/// Distances of the contacts of `motion` along their normals.
std::vector<double> contact_distances(const PosedScan& scan, const Transform& motion) {
  std::vector<double> distances;
  for (const Contact& contact : flat_contacts(measured_pose(scan.views1), measured_pose(scan.views2), motion)) {
    EXPECT_TRUE(contact.is_flat);
    distances.push_back(contact.normal_in_pose1.dot(motion * contact.point_in_pose2) - contact.offset_mm);
  }
  return distances;
}

TEST(FlatContacts, OfABlockUpsideDownTellHowHighItStands) {
  const PosedScan scan = testing::scan(testing::block({-30, 0, -20}, {30, 30, 20}), kUpsideDown);
  for (const double off_mm : {0.0, 0.3}) {
    const auto distances = contact_distances(scan, Eigen::Translation3d(0, off_mm, 0) * scan.pose1_from_pose2);
    ASSERT_EQ(distances.size(), 2U);  // either pose's top lies on the other's table
    for (const double distance : distances) EXPECT_NEAR(std::abs(distance), off_mm, 0.02);
  }
}

/// Its end lay on pose 1's table; along the line on which it lies in pose 2 it is round.
TEST(FlatContacts, OfACylinderLaidDownAreItsEndOnly) {
  const Eigen::Matrix3d laid = turn(25, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitX());
  const PosedScan scan = testing::scan(testing::upright_cylinder({0, 0, 0}, 20, 50), laid);
  const auto distances = contact_distances(scan, Eigen::Translation3d(0, 0.3, 0) * scan.pose1_from_pose2);
  ASSERT_EQ(distances.size(), 1U);
  EXPECT_NEAR(std::abs(distances[0]), 0.3, 0.02);
}

TEST(FlatContacts, AreNothingThatIsRoundOrThatStandsOnSomethingElse) {
  const PosedScan ball = testing::scan(testing::ball({0, 25, 0}, 25), kUpsideDown);
  EXPECT_TRUE(contact_distances(ball, ball.pose1_from_pose2).empty());
  const PosedScan on_a_foot = testing::scan(
      testing::together({testing::block({-30, 0, -20}, {30, 30, 20}), testing::ball({0, 24, 0}, 6.8)}), kUpsideDown);
  EXPECT_EQ(contact_distances(on_a_foot, on_a_foot.pose1_from_pose2).size(), 1U);  // of the other pose's table
}

/// Putty lifts it in pose 2, so its flat top is near pose 2's table and yet not on it.
TEST(RefineFound, TakesNothingForATableOnAFixture) {
  const PosedScan scan = testing::scan(testing::block({-30, 0, -20}, {30, 30, 20}), kUpsideDown, 0.6);
  const MeasuredPose measured1 = measured_pose(scan.views1), measured2 = measured_pose(scan.views2);
  const auto height = [&](bool on_fixture) {
    PoseOptions options;
    options.stable_tangent_planes = !on_fixture;
    const auto refined = refine_found({&measured1, scan.views1}, {&measured2, scan.views2}, scan.pose1_from_pose2,
                                      after_search(), options, {});
    return refined ? refined->pose1_from_pose2.translation().y() : std::nan("");
  };
  EXPECT_GT(std::abs(height(false) - height(true)), 0.1);
}

/// A cylinder with a bump, whose roundness errs by 0.05 mm, not alike in both poses: what most of it fits best is not
/// how it was turned.
Solid out_of_round(double phase_deg) {
  const double phase = to_radians(phase_deg);
  const Solid body = [phase](const Eigen::Vector3d& p) {
    const double radius = 20.0 + 0.05 * std::cos(2.0 * (std::atan2(p.z(), p.x()) - phase));
    return std::max(std::hypot(p.x(), p.z()) - radius, std::abs(p.y() - 25.0) - 25.0);
  };
  return testing::with_bump(body, {20, 30, 0}, Eigen::Vector3d::UnitX(), 0.3, 8);
}

TEST(RefineFound, LeavesTheTurnThatASmallFeatureShows) {
  const Eigen::Matrix3d laid = turn(25, Eigen::Vector3d::UnitY()) * turn(90, Eigen::Vector3d::UnitX());
  PosedScan scan = testing::scan(out_of_round(0), laid);
  const PosedScan other = testing::scan(out_of_round(20), laid);
  const MeasuredPose measured1 = measured_pose(scan.views1), measured2 = measured_pose(other.views2);
  const auto error_deg = [&](const Result<RefinedPose>& refined) {
    return to_degrees(rotation_angle(refined->pose1_from_pose2.linear().transpose() * scan.pose1_from_pose2.linear()));
  };
  const auto drifted = refine_pose(measured1, measured2, scan.pose1_from_pose2, after_search(), {});
  const auto kept = refine_found({&measured1, scan.views1}, {&measured2, other.views2}, scan.pose1_from_pose2,
                                 after_search(), {}, {});
  ASSERT_TRUE(drifted) << drifted.error().message;
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_GT(error_deg(drifted), 1.0);
  EXPECT_LT(error_deg(kept), 0.1);
  const auto turn_sigma = [](const Result<RefinedPose>& refined) {
    return principal_sigmas(refined->covariance.topLeftCorner<3, 3>()).sigma[0];
  };
  EXPECT_NEAR(turn_sigma(kept) / turn_sigma(drifted), 1.0, 0.01);  // what holds it is as weak as it was
}

}  // namespace
}  // namespace scanrig
