#include "pipeline/texture/photo_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "tests/unit/pipeline/texture/painted_scene.h"

namespace scanrig {
namespace {

using namespace testing;
constexpr double kCameraElevation = 22.0 * std::numbers::pi / 180.0;

PaintedScene ball() {
  PaintedScene scene;
  scene.balls = {{{3.0, 45.0, -2.0}, 35.0}};
  scene.paint = [](std::size_t, const Eigen::Vector3d& p) { return Eigen::Vector3d(0.6 * striped(p)); };
  return scene;
}

/// Deep copies: each test spoils its own.
std::vector<Photo> photos() {
  static const auto taken = ball().photos(rig_camera(0.0, kCameraElevation, 0.25), turns(16));
  std::vector<Photo> copies = taken;
  for (Photo& photo : copies) photo.image = photo.image.clone();
  return copies;
}

cv::Point middle_of(const Photo& photo) {
  const Eigen::Vector2d at = photo.camera.project(photo.turntable_from_model * Eigen::Vector3d(3.0, 45.0, -2.0));
  return {static_cast<int>(at.x()), static_cast<int>(at.y())};
}

/// Brightness times `factor`, as the sensor clips it.
void scale_disc(Photo& photo, int radius, double factor) {
  cv::Mat1b disc(photo.image.size(), uchar{0});
  cv::circle(disc, middle_of(photo), radius, 255, cv::FILLED);
  cv::Mat scaled;
  photo.image.convertTo(scaled, -1, factor);
  scaled.copyTo(photo.image, disc);
}

Result<TexturedModel> textured(const std::vector<Photo>& photos) {
  return texture_mesh(ball().mesh(1.0), photos, {.atlas_px = 512}, {});
}

double worst_difference(const TexturedModel& a, const TexturedModel& b) {
  double worst = 0.0;
  for (std::size_t v = 0; v < a.mesh.mesh.colour.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(1.0 * a.mesh.mesh.colour[v][static_cast<std::size_t>(c)] -
                                       b.mesh.mesh.colour[v][static_cast<std::size_t>(c)]));
    }
  }
  return worst;
}

TEST(PhotoCheck, SoundPhotosAreAllUsed) {
  const auto model = textured(photos());
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_TRUE(model->contradicted.empty());
}

TEST(PhotoCheck, AFingersShadowIsNamedAndItsPartLeftOut) {
  const auto sound = textured(photos());
  auto taken = photos();
  scale_disc(taken[5], 20, 0.4);
  const auto model = textured(taken);
  ASSERT_TRUE(sound && model);
  ASSERT_EQ(model->contradicted.size(), 1U);
  EXPECT_EQ(model->contradicted[0].photo, 5U);
  EXPECT_NEAR(model->contradicted[0].brightness, 0.4, 0.1);
  EXPECT_FALSE(model->contradicted[0].is_whole);
  EXPECT_NEAR(model->contradicted[0].share, std::pow(20.0 / 58.0, 2), 0.1);  // the ball's radius is 58 px
  EXPECT_LE(worst_difference(*sound, *model), 6.0);
}

TEST(PhotoCheck, AReflectionIsNamed) {
  auto taken = photos();
  cv::circle(taken[9].image, middle_of(taken[9]), 18, cv::Scalar::all(255), cv::FILLED);
  const auto model = textured(taken);
  ASSERT_TRUE(model);
  ASSERT_EQ(model->contradicted.size(), 1U);
  EXPECT_EQ(model->contradicted[0].photo, 9U);
  EXPECT_GT(model->contradicted[0].brightness, 1.3);
}

TEST(PhotoCheck, AnOverexposedPhotoIsLeftOutWhole) {
  auto taken = photos();
  scale_disc(taken[2], 300, 2.0);
  const auto model = textured(taken);
  ASSERT_TRUE(model);
  ASSERT_EQ(model->contradicted.size(), 1U);
  EXPECT_EQ(model->contradicted[0].photo, 2U);
  EXPECT_TRUE(model->contradicted[0].is_whole);
}

TEST(PhotoCheck, ADifferenceThatEveryPhotoShowsIsTheSurface) {
  auto taken = photos();
  for (Photo& photo : taken) scale_disc(photo, 12, 1.6);  // a highlight that stays in the rig
  const auto model = textured(taken);
  ASSERT_TRUE(model);
  EXPECT_TRUE(model->contradicted.empty());
}

TEST(PhotoCheck, FindsTheSameForAnyNumberOfThreads) {
  auto taken = photos();
  scale_disc(taken[5], 20, 0.4);
  std::vector<double> shares;
  for (const int threads : {1, 3}) {
    with_threads(threads, [&] {
      const auto model = textured(taken);
      ASSERT_TRUE(model);
      ASSERT_EQ(model->contradicted.size(), 1U);
      shares.push_back(model->contradicted[0].share);
      shares.push_back(model->contradicted[0].brightness);
    });
  }
  ASSERT_EQ(shares.size(), 4U);
  EXPECT_EQ(shares[0], shares[2]);
  EXPECT_EQ(shares[1], shares[3]);
}

}  // namespace
}  // namespace scanrig
