#include "sim/scene/optics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

#include "core/units.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

TEST(Eye, ProjectsAsOpenCvDoes) {
  const Eye eye = default_rig().left;
  const Vector3d point(30.0, 70.0, -20.0);
  const Vector3d q = eye.eye_from_turntable * point;
  const cv::Matx33d k(eye.fx, 0, eye.cx, 0, eye.fy, eye.cy, 0, 0, 1);
  std::vector<cv::Point2d> pixel;
  cv::projectPoints(std::vector<cv::Point3d>{{q.x(), q.y(), q.z()}}, cv::Vec3d(), cv::Vec3d(), k, eye.distortion,
                    pixel);
  EXPECT_NEAR(eye.project(point).x(), pixel[0].x, 1e-9);
  EXPECT_NEAR(eye.project(point).y(), pixel[0].y, 1e-9);
}

TEST(Eye, RayLeadsBackToThePixel) {
  const Eye eye = default_rig().right;
  for (const double u : {0.0, 640.0, 1279.0}) {
    for (const double v : {0.0, 480.0, 959.0}) {
      const Vector3d point = eye.eye_from_turntable.inverse() * (600.0 * eye.ray(u, v));
      EXPECT_NEAR(eye.project(point).x(), u, 1e-6);
      EXPECT_NEAR(eye.project(point).y(), v, 1e-6);
    }
  }
}

TEST(DefaultRig, IsTheOneOfTheDesign) {
  const RigGeometry rig = default_rig();
  EXPECT_NEAR((rig.left.centre() - rig.right.centre()).norm(), 160.0, 1e-9);
  const Vector3d middle = 0.5 * (rig.left.centre() + rig.right.centre()) - Vector3d(0.0, 45.0, 0.0);
  EXPECT_NEAR(middle.norm(), 640.0, 1e-9);
  EXPECT_NEAR(to_degrees(std::asin(middle.normalized().y())), 22.0, 1e-9);
  EXPECT_NEAR(rig.projector.centre().y() - 0.5 * (rig.left.centre() + rig.right.centre()).y(), 90.0, 1e-9);
  EXPECT_LT(rig.left.centre().x(), 0.0);
  // The aim point is seen in the middle of every image, and up in space is up in the image.
  for (const Eye* eye : {&rig.left, &rig.right, &rig.projector}) {
    const auto aim = eye->project({0.0, 45.0, 0.0});
    EXPECT_NEAR(aim.x(), 0.5 * eye->width, 4.0);
    EXPECT_NEAR(aim.y(), 0.5 * eye->height, 4.0);
    EXPECT_LT(eye->project({0.0, 60.0, 0.0}).y(), aim.y());
    EXPECT_GT(eye->project({20.0, 45.0, 0.0}).x(), aim.x());
  }
}

TEST(DefaultRig, SeesTheSameFieldAtAnyResolution) {
  const RigGeometry full = default_rig(), small = default_rig(0.25);
  EXPECT_EQ(small.left.width, 320);
  const Vector3d corner = full.left.ray(-0.5, -0.5), same = small.left.ray(-0.5, -0.5);
  EXPECT_LT((corner - same).norm(), 1e-9);
}

TEST(Profile, IsFrozen) {
  // A change of any constant needs a new version; then this hash is replaced.
  EXPECT_EQ(profile().version, 1);
  EXPECT_EQ(profile_sha256(), "42963342fc4e86381aa5ed0760ef5f53633fe94a49312a708202a167644ef1c0");
}

}  // namespace
}  // namespace scanrig::sim
