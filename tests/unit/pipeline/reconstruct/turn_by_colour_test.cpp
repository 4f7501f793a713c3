#include "pipeline/reconstruct/turn_by_colour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/units.h"

namespace scanrig {
namespace {

/// Paint of a place of the object, BGR.
using Paint = std::function<Eigen::Vector3f(const Eigen::Vector3d&)>;

Eigen::Vector3f uniform(const Eigen::Vector3d&) { return {0.3F, 0.32F, 0.28F}; }

/// Blots of some centimetres.
Eigen::Vector3f blotted(const Eigen::Vector3d& p) {
  const double red = std::sin(0.21 * p.x() + 1.0) * std::cos(0.17 * p.y() + 0.13 * p.z());
  const double blue = std::sin(0.25 * p.z() - 0.4) * std::cos(0.11 * p.x() - 0.19 * p.y());
  return Eigen::Vector3f(static_cast<float>(0.3 + 0.15 * blue), 0.3F, static_cast<float>(0.3 + 0.15 * red));
}

/// Every place of the pose in its frame, with noise of `noise` of the paint and the light `gain` from above.
struct Shown {
  Paint paint = blotted;
  Transform pose_from_object = Transform::Identity();
  float gain = 1.0F;
  float noise = 0.02F;
  unsigned seed = 1;
};

std::vector<PaintedPoint> painted(std::vector<PaintedPoint> object, const Shown& shown) {
  std::mt19937 random(shown.seed);
  std::normal_distribution<float> noise(1.0F, shown.noise);
  std::vector<PaintedPoint> seen;
  for (PaintedPoint& p : object) {
    const Eigen::Vector3f paint = shown.paint(p.point);
    p.point = shown.pose_from_object * p.point;
    p.normal = shown.pose_from_object.linear() * p.normal;
    if (p.normal.y() < -0.7) continue;  // it lies there
    const float light = shown.gain * (1.0F + 0.2F * static_cast<float>(p.normal.y()));
    p.bgr = light * Eigen::Vector3f(paint.x() * noise(random), paint.y() * noise(random), paint.z() * noise(random));
    seen.push_back(p);
  }
  return seen;
}

/// Radius 20, height 60, about the y axis.
std::vector<PaintedPoint> cylinder() {
  std::vector<PaintedPoint> points;
  for (double y = 0.4; y < 60.0; y += 0.8) {
    for (int k = 0; k < 160; ++k) {
      const double a = 2.0 * std::numbers::pi * (k + 0.5 * std::fmod(y, 1.6)) / 160.0;
      const Eigen::Vector3d n(std::cos(a), 0.0, std::sin(a));
      points.push_back({20.0 * n + y * Eigen::Vector3d::UnitY(), n, Eigen::Vector3f::Zero()});
    }
  }
  return points;
}

std::vector<PaintedPoint> ball() {
  std::vector<PaintedPoint> points;
  constexpr int kCount = 9000;
  for (int k = 0; k < kCount; ++k) {
    const double y = 1.0 - (2.0 * k + 1.0) / kCount, r = std::sqrt(1.0 - y * y), a = 2.39996323 * k;
    const Eigen::Vector3d n(r * std::cos(a), y, r * std::sin(a));
    points.push_back({25.0 * n, n, Eigen::Vector3f::Zero()});
  }
  return points;
}

/// The object laid down: pose 2 from the object's frame, which is pose 1's.
Transform laid_down() {
  Transform t = Transform::Identity();
  t.linear() = (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  t.translation() = Eigen::Vector3d(3, 21, -30);
  return t;
}

const FreeTurn kUpright{};

Transform turned(double degrees, const Transform& t) {
  return Transform(Eigen::AngleAxisd(to_radians(degrees), Eigen::Vector3d::UnitY())) * t;
}

double degrees_between(const Transform& a, const Transform& b) {
  return to_degrees(rotation_angle(a.linear().transpose() * b.linear()));
}

TEST(TurnByColour, FindsTheTurnOfAPaintedCylinder) {
  const Transform truth = laid_down().inverse();
  const auto pose1 = painted(cylinder(), {});
  const auto pose2 = painted(cylinder(), {.pose_from_object = laid_down(), .gain = 0.6F, .seed = 2});
  for (const double off : {0.0, 77.0, 181.0}) {
    const std::vector<Transform> start = {turned(off, truth)};
    const ColourDecision decision = turn_by_colour(pose1, pose2, start, {&kUpright, 1});
    EXPECT_TRUE(decision.is_decided) << decision.confidence;
    EXPECT_LT(degrees_between(decision.pose1_from_pose2, truth), 1.0);
    EXPECT_GT(decision.correlation, 0.8);
  }
}

TEST(TurnByColour, IsUndecidedOnAUniformCylinder) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto pose1 = painted(cylinder(), {.paint = uniform, .seed = seed});
    const auto pose2 = painted(cylinder(), {.paint = uniform, .pose_from_object = laid_down(), .seed = seed + 100});
    const std::vector<Transform> start = {turned(20.0, laid_down().inverse())};
    const ColourDecision decision = turn_by_colour(pose1, pose2, start, {&kUpright, 1});
    EXPECT_FALSE(decision.is_decided) << decision.confidence << " " << decision.correlation;
    EXPECT_TRUE(decision.pose1_from_pose2.matrix() == start[0].matrix());
  }
}

/// Painted alike every 120 deg: three turns fit.
TEST(TurnByColour, IsUndecidedWhereThePaintIsAsSymmetric) {
  const Paint thirds = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3f(0.3F, 0.3F, static_cast<float>(0.3 + 0.15 * std::sin(3.0 * std::atan2(p.z(), p.x()))));
  };
  const auto pose1 = painted(cylinder(), {.paint = thirds});
  const auto pose2 = painted(cylinder(), {.paint = thirds, .pose_from_object = laid_down(), .seed = 2});
  const std::vector<Transform> start = {laid_down().inverse()};
  EXPECT_FALSE(turn_by_colour(pose1, pose2, start, {&kUpright, 1}).is_decided);
}

TEST(TurnByColour, ChoosesAmongTheMotionsOfAFiniteGroup) {
  const Transform truth = laid_down().inverse();
  const auto pose1 = painted(cylinder(), {});
  const auto pose2 = painted(cylinder(), {.pose_from_object = laid_down(), .seed = 2});
  const std::vector<Transform> four = {turned(90, truth), turned(180, truth), truth, turned(270, truth)};
  const ColourDecision decision = turn_by_colour(pose1, pose2, four, {});
  EXPECT_TRUE(decision.is_decided) << decision.confidence;
  EXPECT_TRUE(decision.pose1_from_pose2.matrix() == truth.matrix());
}

TEST(TurnByColour, FindsAllThreeTurnsOfAPaintedBall) {
  const Transform truth = laid_down().inverse();
  const auto pose1 = painted(ball(), {});
  const auto pose2 = painted(ball(), {.pose_from_object = laid_down(), .gain = 1.4F, .seed = 2});
  const std::vector<FreeTurn> free = {{Eigen::Vector3d::UnitX(), {0, 0, 0}},
                                      {Eigen::Vector3d::UnitY(), {0, 0, 0}},
                                      {Eigen::Vector3d::UnitZ(), {0, 0, 0}}};
  const Transform off(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, -1).normalized()));
  const std::vector<Transform> start = {off * truth};
  const ColourDecision decision = turn_by_colour(pose1, pose2, start, free);
  EXPECT_TRUE(decision.is_decided) << decision.confidence;
  EXPECT_LT(degrees_between(decision.pose1_from_pose2, truth), 2.0);
}

TEST(TurnByColour, IsUndecidedWithoutPaint) {
  const std::vector<Transform> start = {laid_down().inverse()};
  EXPECT_FALSE(turn_by_colour({}, {}, start, {}).is_decided);
}

}  // namespace
}  // namespace scanrig
