#include "pipeline/pose/rest_pairs.h"

#include <gtest/gtest.h>

#include <random>

#include "core/units.h"

namespace scanrig {
namespace {

/// Contacts of two perfect models of one object, the truth being `pose1_from_pose2`.
struct Contacts {
  RestPair pair;
  SolidProperties solid1, solid2;
};

Contacts contacts_of(const Transform& pose1_from_pose2, const Eigen::Vector3d& centre1) {
  const Transform back = pose1_from_pose2.inverse();
  Contacts c;
  c.pair.of_pose1.normal = pose1_from_pose2.linear() * base_normal();
  c.pair.of_pose1.offset_mm = c.pair.of_pose1.normal.dot(pose1_from_pose2.translation());  // pose 2's table in pose 1
  c.pair.of_pose2.normal = back.linear() * base_normal();
  c.pair.of_pose2.offset_mm = c.pair.of_pose2.normal.dot(back.translation());
  c.solid1.centre_of_mass = centre1;
  c.solid2.centre_of_mass = back * centre1;
  return c;
}

Transform random_motion(std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Transform t = Transform::Identity();
  t.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                   .normalized()
                   .toRotationMatrix();
  t.translation() = 30.0 * Eigen::Vector3d(normal(random), normal(random), normal(random));
  return t;
}

double best_error_deg(const Contacts& c, const Transform& truth) {
  double best = 180.0;
  for (const double swivel : swivels_of(c.pair)) {
    const Transform t = transform_of(c.pair, c.solid1, c.solid2, swivel);
    best = std::min(best, to_degrees(rotation_angle(t.linear().transpose() * truth.linear())));
  }
  return best;
}

TEST(RestPairs, TwoContactsAndTheCentresOfMassGiveTheMotionExactly) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const Transform truth = random_motion(random);
    const Contacts c = contacts_of(truth, {3, 25, -4});
    const Transform t = transform_of(c.pair, c.solid1, c.solid2, 0.0);
    const double tilt = std::acos(-truth.linear()(1, 1));  // from upside down
    if (tilt < 0.02 || tilt > std::numbers::pi - 0.02) continue;
    EXPECT_NEAR(t.linear().determinant(), 1.0, 1e-12);
    EXPECT_LT((t.linear() - truth.linear()).norm(), 1e-9);
    EXPECT_LT((t.translation() - truth.translation()).norm(), 1e-8);
  }
}

TEST(RestPairs, UpsideDownTheSweepComesWithinFiveDegrees) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> angle(0.0, 360.0);
  for (int trial = 0; trial < 50; ++trial) {
    Transform truth = Transform::Identity();
    truth.linear() = (Eigen::AngleAxisd(to_radians(angle(random)), Eigen::Vector3d::UnitY()) *
                      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()))
                         .toRotationMatrix();
    truth.translation() = Eigen::Vector3d(4, 70, -6);
    EXPECT_LT(best_error_deg(contacts_of(truth, {1, 35, 2}), truth), 5.01);
  }
}

TEST(RestPairs, TheTruePairSurvivesNormalsThatJitterAndModelsThatAreTooTall) {
  std::mt19937 random(5);
  std::normal_distribution<double> jitter(0.0, to_radians(3.0));
  for (int trial = 0; trial < 100; ++trial) {
    Contacts c = contacts_of(random_motion(random), {0, 30, 0});
    const Eigen::Vector3d turn(jitter(random), jitter(random), jitter(random));
    c.pair.of_pose1.normal = small_motion(turn, Eigen::Vector3d::Zero()).linear() * c.pair.of_pose1.normal;
    c.pair.of_pose1.height_mm = 84;
    c.pair.of_pose2.height_mm = 62;
    const RestingSolid solid1{{.size_mm = 100}, 60, {c.pair.of_pose1}};
    const RestingSolid solid2{{.size_mm = 100}, 80, {c.pair.of_pose2}};
    EXPECT_EQ(pair_rests(solid1, solid2, {}).size(), 1u);
  }
}

TEST(RestPairs, TheBestAgreementComesFirst) {
  const StableRest right{base_normal(), 0, 60, 5};
  const StableRest too_tall{base_normal(), 0, 66, 5};
  const RestingSolid solid1{{.size_mm = 100}, 60, {too_tall, right}};
  const RestingSolid solid2{{.size_mm = 100}, 60, {right}};
  const auto pairs = pair_rests(solid1, solid2, {});
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].of_pose1.height_mm, 60);
}

}  // namespace
}  // namespace scanrig
