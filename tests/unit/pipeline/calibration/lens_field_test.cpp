#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/distortion_table.h"

namespace scanrig {
namespace {

Camera camera_with_field() {
  Camera camera;
  camera.projection = {Projection::Kind::pinhole, 1280, 960, 4266.7, 4267.0, 637.0, 481.0};
  camera.distortion = {-0.08, 0.15, 1.2e-4, -0.9e-4, 0.01};
  camera.lens_field.emplace();
  camera.lens_field->width = 1280;
  camera.lens_field->height = 960;
  for (std::size_t i = 0; i < camera.lens_field->shift.size(); ++i) {
    const auto k = static_cast<double>(i);
    camera.lens_field->shift[i] = {0.4 * std::sin(1.7 * k), 0.4 * std::cos(2.3 * k)};
  }
  return camera;
}

TEST(LensField, RaysHitThePixelTheyStartFrom) {
  const Camera camera = camera_with_field();
  double greatest = 0.0;
  for (double v = -20.0; v < 980.0; v += 37.0) {
    for (double u = -20.0; u < 1300.0; u += 41.0) {
      greatest = std::max(greatest, (camera.project(500.0 * camera.ray({u, v})) - Eigen::Vector2d(u, v)).norm());
    }
  }
  EXPECT_LT(greatest, 1e-9);
}

TEST(DistortionTable, GivesTheCamerasPixels) {
  const Camera camera = camera_with_field();
  const DistortionTable table(camera);
  double off = 0.0, added = 0.0;
  for (double v = -2.0; v < 962.0; v += 3.7) {
    for (double u = -2.0; u < 1282.0; u += 4.1) {
      const Eigen::Vector2d pixel(u, v), pinhole = camera.projection.project(camera.ray(pixel));
      off = std::max(off, (table.distorted(pinhole) - pixel).norm());
      added = std::max(added, (pixel - pinhole).norm());
    }
  }
  EXPECT_GT(added, 0.5) << "else this test shows nothing";
  EXPECT_LT(off, 0.01);
}

TEST(LensField, ACommonCoefficientShiftsEveryPixelAlike) {
  Camera camera = camera_with_field();
  Camera plain = camera;
  plain.lens_field.reset();
  camera.lens_field->shift.fill({0.25, -0.5});
  const Eigen::Vector3d point(12.0, -31.0, 600.0);
  EXPECT_LT((camera.project(point) - plain.project(point) - Eigen::Vector2d(0.25, -0.5)).norm(), 1e-12);
}

TEST(LensField, CoefficientsOnALineGiveALine) {
  LensField field;
  field.width = 1281;
  field.height = 961;
  for (int i = 0; i < LensField::kCount; ++i) {
    const int column = i % LensField::kColumns, row = i / LensField::kColumns;
    field.shift[static_cast<std::size_t>(i)] = {0.1 * column, 0.2 * row};
  }
  // Knots are 320 px apart; the first coefficient lies one knot before the image.
  EXPECT_LT((field.at({480.0, 160.0}) - Eigen::Vector2d(0.1 * 2.5, 0.2 * 1.5)).norm(), 1e-12);
  EXPECT_LT((field.at({1280.0, 960.0}) - Eigen::Vector2d(0.1 * 5.0, 0.2 * 4.0)).norm(), 1e-12);
  EXPECT_LT((field.at({1400.0, 960.0}) - field.at({1280.0, 960.0})).norm(), 1e-12);
}

TEST(LensField, WithoutOneAPixelIsBrownsOwn) {
  Camera camera = camera_with_field();
  camera.lens_field.reset();
  camera.distortion = {};
  const Eigen::Vector2d pixel = camera.project({30.0, 20.0, 600.0});
  EXPECT_EQ(pixel.x(), 4266.7 * (30.0 / 600.0) + 637.0);
  EXPECT_EQ(camera.ray({637.0, 481.0}), Eigen::Vector3d(0.0, 0.0, 1.0));
}

}  // namespace
}  // namespace scanrig
