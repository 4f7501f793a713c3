#include "pipeline/registration/range_surface.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig {
namespace {

const Eigen::Vector3d kCentre(3, 30, -2);
constexpr double kRadius = 20.0;

const RangeLevel& ball_level(int level) {
  static const auto pyramid = range_pyramid(testing::turn_around(testing::ball(kCentre, kRadius), 4, {}), 3);
  return pyramid[level];
}

TEST(RangeSurface, LiesOnACurvedSurfaceBetweenItsPixels) {
  const RangeImage& image = ball_level(0)[0];
  const Eigen::Vector3d centre = image.camera_from_pose * kCentre;
  const Eigen::Vector2d middle = image.projection.project(centre);
  for (int k = -40; k <= 40; ++k) {  // 0.4 mm pixels: chords alone are up to 1e-3 mm inside, more at a slant
    const auto s = surface_at(image, middle + Eigen::Vector2d(0.5 + k, 0.37 + 0.5 * k));
    ASSERT_TRUE(s);
    EXPECT_NEAR((s->point - centre).norm(), kRadius, 2e-4);
    EXPECT_NEAR(s->normal.dot((s->point - centre).normalized()), 1.0, 1e-4);
  }
}

TEST(RangeSurface, TheNearestTangentPlaneTouchesAtTheFootOfThePoint) {
  const RangeImage& image = ball_level(0)[0];
  const Eigen::Vector3d centre = image.camera_from_pose * kCentre;
  const Eigen::Vector3d outward = Eigen::Vector3d(0.3, -0.4, -1.0).normalized();
  const auto plane = tangent_plane_near(image, centre + (kRadius + 3.0) * outward);
  ASSERT_TRUE(plane);
  EXPECT_LT((plane->point - (centre + kRadius * outward)).norm(), 0.1);
}

TEST(RangeSurface, NothingIsBetweenTwoSurfaces) {
  const auto step =
      testing::together({testing::block({-30, 0, -20}, {0, 40, -10}), testing::block({0, 0, 0}, {30, 40, 20})});
  const auto views = testing::turn_around(step, 1, {});
  const RangeImage& image = views[0].range;
  const Eigen::Vector2d edge = image.projection.project(image.camera_from_pose * Eigen::Vector3d(0, 20, 20));
  for (int row = 0; row < image.depth.rows; ++row) {
    for (double column = edge.x() - 2; column < edge.x() + 2; column += 0.1) {
      const auto s = surface_at(image, {column, row});
      if (!s) continue;
      EXPECT_LT(std::abs(step(image.camera_from_pose.inverse() * s->point)), 0.01);
    }
  }
}

TEST(RangeSurface, CoarserLevelsDescribeTheSameSurface) {
  const RangeImage& image = ball_level(2)[1];
  const Eigen::Vector3d centre = image.camera_from_pose * kCentre;
  const auto samples = sample_image(image, 500);
  ASSERT_GT(samples.size(), 200u);
  for (const SurfacePoint& s : samples) {
    if (s.facing > 0.4) {
      EXPECT_NEAR((s.point - centre).norm(), kRadius, 0.05);
    }
  }
}

TEST(RangeSurface, SamplesOfAllViewsAreSpreadEvenly) {
  const auto samples = sample_surface(ball_level(0), 3.0);
  ASSERT_GT(samples.size(), 200u);
  for (const SurfacePoint& s : samples) {
    EXPECT_NEAR((s.point - kCentre).norm(), kRadius, 1e-3);
    EXPECT_GT(s.facing, 0.2);
  }
  const double count = static_cast<double>(samples.size());
  EXPECT_LT(count, 2.0 * 4.0 * std::numbers::pi * kRadius * kRadius / 9.0);
}

}  // namespace
}  // namespace scanrig
