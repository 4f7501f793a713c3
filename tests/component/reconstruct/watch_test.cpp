// A rendered scan under a calibration that is right, or off by a known turn of the right camera.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/reconstruct/reconstruct.h"
#include "sim/apps/shoot.h"
#include "sim/scene/table_top.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

constexpr double kScale = 0.5;
constexpr int kViews = 4;

/// Knows its dots, and its cameras to a few micrometres.
CalibrationQuality known_quality() {
  CalibrationQuality quality;
  quality.grade = "A";
  quality.cameras = Eigen::MatrixXd::Zero(30, 30);
  for (const int camera : {0, 15}) {
    quality.cameras.diagonal().segment<3>(camera + 9).setConstant(std::pow(3e-7, 2));
    quality.cameras.diagonal().segment<3>(camera + 12).setConstant(std::pow(6e-4, 2));
  }
  for (int i = 0; i < sim::kRimDots; ++i) {
    const Eigen::Vector2d at = sim::rim_dot_centre(i);
    quality.rim_dots.emplace_back(at.x(), 0.0, at.y());
  }
  quality.rim_dot_diameter_mm = 2.4;
  return quality;
}

class WatchedScan : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::filesystem::path(testing::TempDir()) / ("scanrig_watched_" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    sim::ShootOptions options;
    options.scene.image_scale = kScale;
    options.scene.poses = 1;
    options.views = kViews;
    const auto shot = sim::shoot(options, folder_);
    ASSERT_TRUE(shot) << shot.error().message;
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder_); }

  static Calibration true_calibration() {
    Calibration calibration = *ScanFolder::open(folder_)->load_calibration();
    calibration.quality = known_quality();
    return calibration;
  }
  /// As if the right camera had turned by so much along its rows since.
  static Calibration outdated(double px) {
    Calibration calibration = true_calibration();
    Camera& right = calibration.right;
    right.camera_from_turntable =
        small_motion({0.0, px / right.projection.fx, 0.0}, Eigen::Vector3d::Zero()) * right.camera_from_turntable;
    return calibration;
  }
  static Result<Model> reconstructed(const Calibration& calibration, const std::string& watch) {
    const auto scan = ScanFolder::open(folder_);
    Reconstruction reconstruction(calibration, {.voxel_mm = 1.5, .texture = false, .watch = watch});
    for (std::size_t v = 0; v < kViews; ++v) {
      const auto images = scan->load_images(0, v);
      if (!images) return pass_on(images);
      if (auto added = reconstruction.add_view(0, *images, {}); !added) return pass_on(added);
    }
    if (auto done = reconstruction.finish_pose(0, {}); !done) return pass_on(done);
    return reconstruction.finish(identity_of(scan->manifest()), {});
  }

  static inline std::filesystem::path folder_;
};

TEST_F(WatchedScan, OfAnUntouchedRigIsSilent) {
  const auto model = reconstructed(true_calibration(), "refine");
  ASSERT_TRUE(model) << model.error().message;
  const auto& watch = (*model->report)["poses"][0]["watch"];
  std::cout << watch.dump() << "\n";
  EXPECT_EQ(watch["verdict"], "holds");
  EXPECT_TRUE(watch["sentences"].empty());
  EXPECT_TRUE(watch["refined"].is_null());
  for (const auto& dots : watch["dots"]) EXPECT_GT(dots.get<int>(), 15 * kViews);
  EXPECT_GT(watch["rows"].get<int>(), 3 * kViews);
}

TEST_F(WatchedScan, IsRefinedWhenTheRightCameraHasTurned) {
  const Calibration outdated_calibration = outdated(0.1);
  const auto model = reconstructed(outdated_calibration, "refine");
  ASSERT_TRUE(model) << model.error().message;
  const auto& watch = (*model->report)["poses"][0]["watch"];
  std::cout << watch.dump() << "\n";
  EXPECT_EQ(watch["verdict"], "moved");
  ASSERT_EQ(watch["sentences"].size(), 1U);
  EXPECT_THAT(watch["sentences"][0].get<std::string>(), HasSubstr("Right camera moved by 0."));
  ASSERT_FALSE(watch["refined"].is_null());
  // The disparity in the middle of the volume is back where it was. Roll hardly shows there, and is not known better.
  const auto column_shift = [&](const char* side, const Camera& truth) {
    const auto& pose = watch["refined"][side]["camera_from_turntable"];
    Camera refined = truth;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) refined.camera_from_turntable.linear()(r, c) = pose["rotation"][r][c].get<double>();
      refined.camera_from_turntable.translation()[r] = pose["translation"][r].get<double>();
    }
    const Eigen::Vector3d middle(0.0, 57.0, 0.0);
    return (refined.project(middle) - truth.project(middle)).x();
  };
  const Calibration truth = true_calibration();
  EXPECT_LT(std::abs(column_shift("left", truth.left) - column_shift("right", truth.right)), 0.03);
}

TEST_F(WatchedScan, ThatIsRefusedNamesTheCameraAndCanStillBeReported) {
  const auto refused = reconstructed(outdated(0.3), "refine");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::below_limits);
  EXPECT_THAT(refused.error().message, HasSubstr("the rig is no longer as calibrated: Right camera moved by 0."));
  const auto model = reconstructed(outdated(0.3), "report");
  ASSERT_TRUE(model) << model.error().message;
  const auto& watch = (*model->report)["poses"][0]["watch"];
  EXPECT_EQ(watch["verdict"], "refused");
  EXPECT_TRUE(watch["refined"].is_null());
}

TEST_F(WatchedScan, RefusesAnUnknownMode) {
  const auto unknown = reconstructed(true_calibration(), "sometimes");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
