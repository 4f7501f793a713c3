#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/evaluate/evaluate.h"
#include "tests/unit/pipeline/evaluate/ball_truth.h"

namespace scanrig {
namespace {

using namespace ball_truth;

double observable_share(const Truth& truth, const Mesh& part) {
  const auto surface = SurfaceIndex::create(truth.mesh);
  const auto samples = sample_surface(part, measured_faces(part, true), 20'000);
  const auto views = observable_views(samples, truth, *surface, {});
  const auto seen = std::count_if(views.begin(), views.end(), [](int n) { return n > 0; });
  return static_cast<double>(seen) / static_cast<double>(views.size());
}

/// All three eyes at one place: a cap is seen, up to 70 degrees of incidence.
Truth one_eye(double elevation_deg) {
  Truth truth = rig_and_ball({30.0});
  truth.left = truth.right = camera_at(place(elevation_deg, 0.0));
  truth.projector_from_turntable = truth.left.camera_from_turntable;
  return truth;
}

/// From the sine rule in the triangle of eye, centre and the cap's rim.
double share_of_cap(double distance) {
  const double incidence = to_radians(70.0);
  return 0.5 * (1.0 - std::cos(incidence - std::asin(kRadius * std::sin(incidence) / distance)));
}

TEST(Observable, OneEyeSeesACapOfABall) {
  const Truth truth = one_eye(22.0);
  EXPECT_NEAR(observable_share(truth, truth.mesh), share_of_cap(640.0), 0.003);
}

TEST(Observable, SeveralViewsAddUpOnlyWhereTheyDiffer) {
  Truth truth = one_eye(0.0);
  truth.poses[0].angles_deg = {10.0, 10.0, 190.0};
  EXPECT_NEAR(observable_share(truth, truth.mesh), 2.0 * share_of_cap(640.0), 0.005);
}

TEST(Observable, ThreeEyesSeeLessThanOne) {
  const double three = observable_share(rig_and_ball({0.0}), ball());
  EXPECT_LT(three, share_of_cap(640.0) - 0.02);
  EXPECT_GT(three, share_of_cap(640.0) - 0.10);
}

TEST(Observable, TheSecondPoseLiesAsInItsPlacement) {
  Truth truth = one_eye(22.0);
  truth.poses[0].table_from_truth.translate(Eigen::Vector3d(0.0, -18.0, 0.0));
  const double lower = observable_share(truth, truth.mesh);
  EXPECT_NEAR(lower, share_of_cap(640.0), 0.01) << "still in the image, still above the table";
  truth.poses[0].table_from_truth.translate(Eigen::Vector3d(0.0, -77.0, 0.0));
  EXPECT_EQ(observable_share(truth, truth.mesh), 0.0) << "below the table";
}

TEST(Observable, TheTableHidesTheBallFromBelow) {
  Truth truth = one_eye(-60.0);
  EXPECT_EQ(observable_share(truth, truth.mesh), 0.0);
  truth.table_radius_mm = 1.0;
  EXPECT_GT(observable_share(truth, truth.mesh), 0.9 * share_of_cap(640.0));
}

TEST(Observable, SurfaceOutOfTheProjectorsReachIsNotObservable) {
  Truth truth = rig_and_ball({0.0});
  ASSERT_GT(observable_share(truth, ball()), 0.2);
  // A plate just before the projector and out of the cameras' sight.
  const Eigen::Vector3d at = kCentre + 0.9 * (place(30.0, 0.0) - kCentre);
  const auto first = static_cast<std::uint32_t>(truth.mesh.vertices.size());
  for (const auto& [x, y] : {std::pair{-30.0, -30.0}, {30.0, -30.0}, {30.0, 30.0}, {-30.0, 30.0}}) {
    truth.mesh.vertices.push_back((at + Eigen::Vector3d(x, y, 0.0)).cast<float>());
  }
  truth.mesh.faces.push_back({first, first + 1, first + 2});
  truth.mesh.faces.push_back({first, first + 2, first + 3});
  EXPECT_EQ(observable_share(truth, ball()), 0.0);
}

TEST(Observable, TheImagesMarginIsOutOfSight) {
  Truth truth = one_eye(22.0);
  truth.left.projection.cx = -150.0;  // the ball is 320 px across: its right half shows
  const double half = observable_share(truth, truth.mesh);
  EXPECT_LT(half, 0.1 * share_of_cap(640.0));
}

TEST(Observable, NearADepthStepNothingIsObservable) {
  // A small ball before the large one: around its outline the large one's surface is not trusted.
  Truth truth = one_eye(0.0);
  truth.poses[0].angles_deg = {0.0};
  const Mesh small = ball(3.0, kCentre + Eigen::Vector3d(0, 0, kRadius + 20.0), 30);
  const double alone = observable_share(truth, ball());
  const auto first = static_cast<std::uint32_t>(truth.mesh.vertices.size());
  truth.mesh.vertices.insert(truth.mesh.vertices.end(), small.vertices.begin(), small.vertices.end());
  for (const auto& f : small.faces) truth.mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  const double hidden = (alone - observable_share(truth, ball())) * 4.0 * kRadius * kRadius;
  // The shadow, 3 mm and a little more in radius, then six pixels of 0.144 mm, and half of the pixels at either end;
  // over pi, nearly flat.
  EXPECT_NEAR(hidden, std::pow(3.0 * 615.0 / 595.0 + 7.0 * 0.144, 2), 0.5);
}

TEST(Undistort, InvertsTheCamerasDistortion) {
  Camera camera = camera_at(place(22.0, 0.0));
  camera.distortion = {-0.08, 0.15, 0.00012, -0.00009, 0.01};
  const Eigen::Vector3d point = kCentre + Eigen::Vector3d(31.0, -22.0, 14.0);
  const Eigen::Vector3d in_camera = camera.camera_from_turntable * point;
  EXPECT_LT((undistort(camera, camera.project(point)) - in_camera.hnormalized()).norm(), 1e-11);
}

}  // namespace
}  // namespace scanrig
