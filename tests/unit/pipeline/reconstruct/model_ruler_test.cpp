#include "pipeline/reconstruct/model_ruler.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "pipeline/mesh/mesh.h"
#include "pipeline/model_io/model_files.h"
#include "tests/unit/pipeline/storage/sample_files.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

constexpr float kSide = 40.0F;  // mm
constexpr float kSigma = 0.01F;

/// A cube with one corner at the origin; the face at z = 0 is closed by silhouettes.
Mesh cube() {
  Mesh mesh;
  for (const float z : {0.0F, kSide}) {
    for (const float y : {0.0F, kSide}) {
      for (const float x : {0.0F, kSide}) mesh.vertices.emplace_back(x, y, z);
    }
  }
  mesh.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.views.assign(8, 4);
  mesh.sigma.assign(8, kSigma);
  return mesh;
}

class ModelRulerTest : public scan_samples::FolderTest {
 protected:
  void write_model(const Mesh& mesh) {
    std::filesystem::create_directories(folder_ / "model");
    scan_samples::write_text(folder_ / "model/model.ply", encode_ply(mesh));
  }
  /// `scale_sigma` of the board's length, 5 um of a point.
  void write_calibration(double scale_sigma) {
    auto json = nlohmann::json::parse(scan_samples::calibration_json());
    std::vector<double> triangle(465, 0.0);
    for (std::size_t row = 0, at = 0; row < 30; at += ++row + 1) triangle[at] = 1e-6;
    json["version"] = 2;
    json["grade"] = "A";
    json["covariance"] = {{"volume_um", 5.0}, {"scale_um", 2.0}, {"cameras", triangle}};
    json["board"] = {{"scale", 1.0}, {"scale_sigma", scale_sigma}, {"warp_mm", {0, 0, 0}}, {"aspect", 0.0},
                     {"shear", 0.0}, {"offsets_mm", {0, 0, 0}}};
    scan_samples::write_text(folder_ / "calibration.json", json.dump());
  }
  ModelLength measured(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const auto length = ruler_.measure(folder_, from, to);
    EXPECT_TRUE(length) << length.error().message;
    return length.value_or(ModelLength{});
  }

  ModelRuler ruler_;
};

TEST_F(ModelRulerTest, PointsNearTheSurfaceAreMovedToItAndTheirDistanceHasAnUncertainty) {
  write_model(cube());
  write_calibration(1e-4);
  const auto length = measured({-0.3, 20, 20}, {40.4, 20, 20});
  EXPECT_NEAR(length.mm, 40.0, 1e-6);
  EXPECT_NEAR(length.from.point.x(), 0.0, 1e-6);
  EXPECT_TRUE(length.from.is_measured);
  ASSERT_TRUE(length.expanded_uncertainty_mm);
  EXPECT_NEAR(*length.expanded_uncertainty_mm, 2.0 * std::sqrt(2 * 0.01 * 0.01 + 2 * 0.005 * 0.005 + 0.004 * 0.004),
              1e-6);
}

TEST_F(ModelRulerTest, SigmaIsAlongTheNormal) {
  write_model(cube());
  write_calibration(1e-4);
  const auto across = measured({40, 10, 20}, {40, 30, 20});  // both ends on one face: its sigma moves neither
  ASSERT_TRUE(across.expanded_uncertainty_mm);
  EXPECT_NEAR(*across.expanded_uncertainty_mm, 2.0 * std::sqrt(2 * 0.005 * 0.005 + 0.002 * 0.002), 1e-6);
}

TEST_F(ModelRulerTest, WhatWasNotMeasuredHasNoUncertainty) {
  Mesh mesh = cube();
  mesh.views[0] = 0;
  mesh.sigma[0] = std::nanf("");
  write_model(mesh);
  write_calibration(1e-4);
  const auto length = measured({5, 5, 0}, {30, 30, 40});
  EXPECT_FALSE(length.from.is_measured);
  EXPECT_TRUE(length.to.is_measured);
  EXPECT_FALSE(length.expanded_uncertainty_mm);
  EXPECT_GT(length.mm, 40.0);
}

TEST_F(ModelRulerTest, ACalibrationThatDoesNotSayGivesNoUncertainty) {
  write_model(cube());
  scan_samples::write_text(folder_ / "calibration.json", scan_samples::calibration_json());
  EXPECT_FALSE(measured({0, 20, 20}, {40, 20, 20}).expanded_uncertainty_mm);
}

TEST_F(ModelRulerTest, APointBesideTheModelIsNamed) {
  write_model(cube());
  const auto length = ruler_.measure(folder_, {0, 20, 20}, {45, 20, 20});
  ASSERT_FALSE(length);
  EXPECT_EQ(length.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(length.error().message, HasSubstr("the second point is farther than 2 mm from the model"));
}

TEST_F(ModelRulerTest, AJobWithoutAModelIsNamed) {
  const auto length = ruler_.measure(folder_, {0, 0, 0}, {1, 1, 1});
  ASSERT_FALSE(length);
  EXPECT_EQ(length.error().code, ErrorCode::not_found);
}

TEST_F(ModelRulerTest, AModelThatWasMadeAgainIsReadAgain) {
  write_model(cube());
  EXPECT_NEAR(measured({0, 20, 20}, {40, 20, 20}).mm, 40.0, 1e-6);
  Mesh larger = cube();
  for (auto& vertex : larger.vertices) vertex *= 1.025F;
  write_model(larger);
  std::filesystem::last_write_time(folder_ / "model/model.ply",
                                   std::filesystem::file_time_type::clock::now() + std::chrono::seconds(5));
  EXPECT_NEAR(measured({0, 20, 20}, {40, 20, 20}).mm, 41.0, 1e-4);
}

}  // namespace
}  // namespace scanrig
