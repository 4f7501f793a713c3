#include <gtest/gtest.h>

#include "core/units.h"
#include "pipeline/reconstruct/rig_watch.h"

namespace scanrig {
namespace {

Camera looking_down_z(double x_mm) {
  Camera camera;
  Projection& p = camera.projection;
  p.width = 1280;
  p.height = 960;
  p.fx = p.fy = 4000.0;
  p.cx = 640.0 + 4000.0 * x_mm / 600.0;
  p.cy = 480.0;
  camera.camera_from_turntable.translation() = Eigen::Vector3d(-x_mm, -40.0, 600.0);
  return camera;
}

/// Of which the right camera's cx alone is not known, to 0.1 px.
Calibration unsure_of_one_pixel() {
  Calibration calibration;
  calibration.left = looking_down_z(-80.0);
  calibration.right = looking_down_z(80.0);
  CalibrationQuality quality;
  quality.cameras = Eigen::MatrixXd::Zero(30, 30);
  quality.cameras(17, 17) = 0.1 * 0.1;
  calibration.quality = quality;
  return calibration;
}

TEST(CalibrationModes, AreTheShiftsOfPointsAndTurnWithTheView) {
  const Calibration calibration = unsure_of_one_pixel();
  const Transform& left = calibration.left.camera_from_turntable;
  const CalibrationModes modes = calibration_modes(calibration, left);
  const Eigen::Vector3d point(10.0, 50.0, 20.0);
  const Eigen::Vector3d front = modes(left, point).rowwise().sum();  // of one error alone
  const double per_px = 620.0 * 620.0 / (4000.0 * 160.0);
  EXPECT_NEAR(front.norm(), 0.1 * per_px, 0.01 * per_px);
  const Transform turned = rot_y(to_radians(70.0));
  const Eigen::Vector3d aside = modes(left * turned, turned.inverse() * point).rowwise().sum();
  EXPECT_LT((turned.linear() * aside - front).norm(), 1e-6);
}

TEST(CalibrationModes, AreNoneOfACalibrationOfUnknownQuality) {
  Calibration calibration = unsure_of_one_pixel();
  calibration.quality.reset();
  EXPECT_FALSE(calibration_modes(calibration, calibration.left.camera_from_turntable));
}

}  // namespace
}  // namespace scanrig
