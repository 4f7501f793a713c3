#include "pipeline/storage/calibration_file.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using namespace scan_samples;

class CalibrationFileTest : public FolderTest {
 protected:
  Result<Calibration> read(const std::string& text) {
    write_text(folder_ / "calibration.json", text);
    return read_calibration(folder_ / "calibration.json");
  }
  void expect_refused(const std::string& what, const std::string& with, const std::string& key) {
    const auto calibration = read(replaced(calibration_json(), what, with));
    ASSERT_FALSE(calibration) << with;
    EXPECT_EQ(calibration.error().code, ErrorCode::invalid_input);
    EXPECT_NE(calibration.error().message.find("calibration.json"), std::string::npos) << calibration.error().message;
    EXPECT_NE(calibration.error().message.find(key), std::string::npos) << calibration.error().message;
  }
};

TEST_F(CalibrationFileTest, AGoodOneIsRead) {
  const auto calibration = read(calibration_json());
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_EQ(calibration->left.serial, "A1");
  EXPECT_EQ(calibration->left.projection.width, 64);
  EXPECT_EQ(calibration->table_radius_mm, 90.0);
  EXPECT_EQ(calibration->left.camera_from_turntable * Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(11, 43, 637));
}

TEST_F(CalibrationFileTest, NumbersThatAreNotFiniteAreRefused) {
  expect_refused("\"fx\": 200.0", "\"fx\": NaN", "JSON");
  expect_refused("\"fx\": 200.0", "\"fx\": null", "left.fx");
  expect_refused("\"fx\": 200.0", "\"fx\": 1e999", "JSON");
  expect_refused("-0.2", "null", "left.distortion[1]");
  expect_refused("[10, 45, 640]", "[10, null, 640]", "left.camera_from_turntable.translation[1]");
}

TEST_F(CalibrationFileTest, AnInvalidRotationMatrixIsRefused) {
  expect_refused("[1, 0, 0]", "[1, 0.01, 0]", "left.camera_from_turntable.rotation");
  expect_refused("[0, 0, -1]", "[0, 0, 1]", "left.camera_from_turntable.rotation: is a mirror");
  expect_refused("[[1, 0, 0], [0, -1, 0], [0, 0, -1]]", "[[1, 0, 0], [0, -1, 0]]",
                 "left.camera_from_turntable.rotation");
}

TEST_F(CalibrationFileTest, ValuesNoRigCanHaveAreRefused) {
  expect_refused("\"fx\": 200.0", "\"fx\": -200.0", "left.fx");
  expect_refused("\"width\": 64", "\"width\": 0", "left.width");
  expect_refused("\"width\": 64", "\"width\": 64.5", "left.width");
  expect_refused("\"cx\": 31.5", "\"cx\": 4000", "left.cx");
  expect_refused("\"table_radius_mm\": 90", "\"table_radius_mm\": 0", "table_radius_mm");
  expect_refused("[10, 45, 640]", "[10, 45, -640]", "left.camera_from_turntable");
  expect_refused("[0.1, -0.2, 0.001, 0.002, 0.05]", "[0.1]", "left.distortion");
}

TEST_F(CalibrationFileTest, ALensFieldIsReadWhereThereIsOne) {
  std::string du = "0.5", dv = "-0.25";
  for (int i = 1; i < 42; ++i) {
    du += ", 0.5";
    dv += ", -0.25";
  }
  const std::string field = "\"lens_correction\": { \"du\": [" + du + "], \"dv\": [" + dv + "] }, \"serial\"";
  const auto plain = read(calibration_json());
  const auto calibration = read(replaced(calibration_json(), "\"serial\"", field));
  ASSERT_TRUE(calibration) << calibration.error().message;
  ASSERT_TRUE(calibration->left.lens_field);
  EXPECT_FALSE(plain->left.lens_field);
  const Eigen::Vector3d point(2.0, 30.0, 4.0);
  const Eigen::Vector2d shift = calibration->left.project(point) - plain->left.project(point);
  EXPECT_LT((shift - Eigen::Vector2d(0.5, -0.25)).norm(), 1e-12);
  expect_refused("\"serial\"", "\"lens_correction\": { \"du\": [1], \"dv\": [" + dv + "] }, \"serial\"",
                 "left.lens_correction.du");
}

TEST_F(CalibrationFileTest, KeysAreStrict) {
  expect_refused("\"serial\"", "\"colour\": 1, \"serial\"", "left.colour");
  expect_refused("\"date\"", "\"day\"", "date");
  expect_refused("scanrig-calibration", "scanrig-scan", "format");
  EXPECT_EQ(read(replaced(calibration_json(), "\"version\": 1", "\"version\": 9")).error().code,
            ErrorCode::unsupported);
  EXPECT_EQ(read_calibration(folder_ / "absent.json").error().code, ErrorCode::not_found);
  EXPECT_TRUE(read(replaced(calibration_json(), "\"date\"", "\"report\": {\"rms_px\": 0.1}, \"date\"")));
}

}  // namespace
}  // namespace scanrig
