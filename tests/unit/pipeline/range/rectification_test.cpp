#include "pipeline/range/rectification.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

Calibration distorted_rig() {
  Calibration calibration = test::default_rig({320, 240});
  calibration.left.distortion = {-0.08, 0.15, 1e-4, -9e-5, 0.0};
  calibration.right.distortion = {-0.084, 0.17, -8e-5, 1.1e-4, 0.0};
  calibration.right.projection.fx += 3.0;
  calibration.right.projection.cy -= 2.5;
  return calibration;
}

TEST(Rectification, APointLiesInTheSameRowAndItsDisparityGivesItsDepth) {
  const auto r = rectify(distorted_rig());
  ASSERT_TRUE(r) << r.error().message;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> around(-20.0, 20.0);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(around(random), 45.0 + around(random), around(random));
    const Eigen::Vector3d in_left = r->left_from_turntable * p;
    const Eigen::Vector2d left = r->left.project(in_left), right = r->right.project(r->right_from_turntable * p);
    EXPECT_NEAR(left.y(), right.y(), 1e-9);
    const double disparity = left.x() - right.x();
    EXPECT_NEAR(r->left.fx * r->baseline_mm / (disparity - r->left.cx + r->right.cx), in_left.z(), 1e-6);
    EXPECT_GE(disparity, r->min_disparity);
    EXPECT_LE(disparity, r->max_disparity);
  }
}

TEST(Rectification, KeepsDisparitiesSmallAlthoughTheCamerasAreToedIn) {
  const auto r = rectify(test::default_rig({1280, 960}));
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_GT(r->min_disparity, -200);
  EXPECT_LT(r->max_disparity, 200);
  EXPECT_GT(std::abs(r->left.cx - r->right.cx), 900.0);
}

TEST(Rectification, ShowsAtEachPixelTheSensorsValueThere) {
  const Calibration calibration = distorted_rig();
  const auto r = rectify(calibration);
  ASSERT_TRUE(r) << r.error().message;
  // Grey values that are a smooth known function of the sensor's pixel.
  const auto value = [](double u, double v) { return 128.0 + 60.0 * std::sin(0.12 * u) * std::cos(0.1 * v); };
  cv::Mat1b sensor(240, 320);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) sensor(v, u) = cv::saturate_cast<std::uint8_t>(value(u, v));
  }
  const auto grey = rectified_grey(r->left_map, sensor);
  const auto plain = rectified(r->left_map, sensor);
  ASSERT_TRUE(grey && plain);
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0, 45, 0), Eigen::Vector3d(12, 50, 3), Eigen::Vector3d(-14, 36, -6)}) {
    const Eigen::Vector2d at = r->left.project(r->left_from_turntable * p);
    const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
    const Eigen::Vector3d on_ray = r->left_from_turntable.inverse() * r->left.unproject(u, v, 650.0);
    const Eigen::Vector2d pixel = calibration.left.project(on_ray);
    EXPECT_NEAR((*grey)(v, u), value(pixel.x(), pixel.y()), 0.6);
    EXPECT_NEAR(plain->at<std::uint8_t>(v, u), value(pixel.x(), pixel.y()), 1.5);
  }
}

TEST(Rectification, RefusesAnInvalidCalibration) {
  Calibration one_place = test::default_rig({320, 240});
  one_place.right = one_place.left;
  Calibration sizes = test::default_rig({320, 240});
  sizes.right.projection.width = 640;
  Calibration no_focal = test::default_rig({320, 240});
  no_focal.left.projection.fx = 0.0;
  Calibration in_line = test::default_rig({320, 240});
  in_line.right = in_line.left;
  in_line.right.camera_from_turntable.translation().z() += 100.0;
  for (const Calibration& calibration : {Calibration(), one_place, sizes, no_focal, in_line}) {
    const auto r = rectify(calibration);
    ASSERT_FALSE(r);
    EXPECT_EQ(r.error().code, ErrorCode::invalid_input) << r.error().message;
  }
}

TEST(Rectification, ReportsCamerasThatDoNotSeeTheTable) {
  Calibration calibration = test::default_rig({320, 240});
  calibration.left.camera_from_turntable.translation().y() += 400.0;
  calibration.right.camera_from_turntable.translation().y() += 400.0;
  const auto r = rectify(calibration);
  ASSERT_FALSE(r);
  EXPECT_EQ(r.error().code, ErrorCode::out_of_range) << r.error().message;
}

TEST(Rectification, RefusesImagesThatDoNotFitTheCalibration) {
  const auto r = rectify(test::default_rig({320, 240}));
  ASSERT_TRUE(r);
  for (const cv::Mat& image :
       {cv::Mat(240, 300, CV_8UC1), cv::Mat(240, 320, CV_8UC2), cv::Mat(240, 320, CV_32SC1), cv::Mat()}) {
    EXPECT_EQ(rectified(r->left_map, image).error().code, ErrorCode::invalid_input);
    EXPECT_EQ(rectified_grey(r->left_map, image).error().code, ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace scanrig
