#include "pipeline/texture/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/mesh/surface_index.h"
#include "pipeline/texture/image_difference.h"
#include "tests/unit/pipeline/texture/painted_scene.h"

namespace scanrig {
namespace {

using namespace testing;

/// A square of 40 mm in the plane z = 0 of the turntable frame, its middle 45 mm up, facing +Z; the atlas lies on it
/// upright, first row at the top.
TexturedMesh square(const cv::Mat3b& atlas) {
  TexturedMesh model;
  model.mesh.vertices = {{-20, 25, 0}, {20, 25, 0}, {20, 65, 0}, {-20, 65, 0}};
  model.mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  model.mesh.colour = {{255, 0, 0}, {255, 0, 0}, {255, 0, 0}, {255, 0, 0}};
  const Eigen::Vector2f a(0, 1), b(1, 1), c(1, 0), d(0, 0);
  model.corner_uv = {{a, b, c}, {a, c, d}};
  model.atlas = atlas;
  return model;
}

TEST(RenderTest, aTexelIsSeenExactlyAtItsPlaceOnTheSurface) {
  cv::Mat3b atlas(40, 40, cv::Vec3b(0, 0, 0));
  atlas(10, 30) = {255, 255, 255};  // its centre is 30.5 mm from the left and 10.5 mm from the top
  const Camera camera = rig_camera(0.2, 0.4, 1.0);
  const auto renderer = MeshRenderer::create(square(atlas));
  ASSERT_TRUE(renderer);
  const auto image = renderer->render(camera, Transform::Identity(), {.supersample = 3});
  ASSERT_TRUE(image);
  cv::Mat1b green;
  cv::extractChannel(image->image, green, 1);
  const cv::Moments moments = cv::moments(green);
  const Eigen::Vector2d wanted = camera.project({-20.0 + 30.5, 65.0 - 10.5, 0.0});
  EXPECT_NEAR(moments.m10 / moments.m00, wanted.x(), 0.05);
  EXPECT_NEAR(moments.m01 / moments.m00, wanted.y(), 0.05);
}

TEST(RenderTest, onlyEdgesAreSmoothedIfAsked) {
  PaintedScene scene;
  scene.balls = {{{3.0, 45.0, -2.0}, 35.0}};
  const auto renderer = MeshRenderer::create({scene.mesh(0.5), {}, {}});
  ASSERT_TRUE(renderer);
  const auto draw = [&](int supersample, bool edges_only) {
    return renderer
        ->render(rig_camera(0.0, 0.4, 0.2), Transform::Identity(),
                 {.surface = Paint::grey, .supersample = supersample, .smooth_edges_only = edges_only})
        ->image;
  };
  const cv::Mat3b once = draw(1, false), smooth = draw(3, false), edges = draw(3, true);
  int at_edge = 0, elsewhere = 0;
  for (int y = 0; y < once.rows; ++y) {
    for (int x = 0; x < once.cols; ++x) {
      if (edges(y, x) != once(y, x)) {
        ++at_edge;
        EXPECT_EQ(edges(y, x), smooth(y, x));
      } else {
        EXPECT_LE(cv::norm(smooth(y, x), once(y, x), cv::NORM_INF), 12.0) << "a visible step at " << x << ", " << y;
        ++elsewhere;
      }
    }
  }
  EXPECT_GT(at_edge, 30);
  EXPECT_GT(elsewhere, 20 * at_edge);
}

TEST(RenderTest, depthIsTheDistanceAlongTheCamerasAxis) {
  PaintedScene scene;
  scene.balls = {{{3.0, 45.0, -2.0}, 35.0}};
  const Camera camera = rig_camera(0.0, 0.4, 0.5);
  const auto renderer = MeshRenderer::create({scene.mesh(0.5), {}, {}});
  ASSERT_TRUE(renderer);
  const auto image = renderer->render(camera, Transform::Identity(), {.surface = Paint::grey});
  ASSERT_TRUE(image);
  const Eigen::Vector3d centre = camera.camera_from_turntable * scene.balls[0].centre;
  const Eigen::Vector2d pixel = camera.project(scene.balls[0].centre);
  const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
  EXPECT_NEAR(image->depth(at), centre.z() * (1.0 - 35.0 / centre.norm()), 0.02);
  EXPECT_EQ(image->mask(at), 255);
  EXPECT_GT(image->image(at)[0], 0);
  EXPECT_TRUE(std::isnan(image->depth(2, 2)));
  EXPECT_EQ(image->mask(2, 2), 0);
}

TEST(RenderTest, vertexColoursAreDrawnWithTheRequestedBackground) {
  const auto renderer = MeshRenderer::create(square(cv::Mat3b(4, 4)));
  const auto image = renderer->render(rig_camera(0.0, 0.3, 0.25), Transform::Identity(),
                                      {.surface = Paint::vertex_colour, .background = {7, 8, 9}});
  ASSERT_TRUE(image);
  EXPECT_EQ(image->image(120, 160), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(image->image(0, 0), cv::Vec3b(7, 8, 9));
}

TEST(RenderTest, anUndrawableMeshIsNamed) {
  EXPECT_EQ(MeshRenderer::create({}).error().code, ErrorCode::degenerate);
  TexturedMesh bare = square(cv::Mat3b(4, 4));
  bare.atlas.release();
  bare.mesh.colour.clear();
  const auto renderer = MeshRenderer::create(bare);
  const Camera camera = rig_camera(0.0, 0.3, 0.25);
  const auto code = [&](const RenderOptions& options) {
    const auto image = renderer->render(camera, Transform::Identity(), options);
    EXPECT_FALSE(image);
    return image ? ErrorCode::internal : image.error().code;
  };
  EXPECT_EQ(code({.surface = Paint::texture}), ErrorCode::invalid_input);
  EXPECT_EQ(code({.surface = Paint::vertex_colour}), ErrorCode::invalid_input);
  EXPECT_EQ(code({.surface = Paint::grey, .supersample = 0}), ErrorCode::invalid_input);
}

cv::Mat3b noise_image(int seed) {
  cv::Mat3b image(240, 320);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {}, 2.0);
  return image;
}

TEST(CompareTest, aKnownShiftIsFoundAndEqualImagesDoNotDiffer) {
  const cv::Mat3b image = noise_image(3);
  const cv::Mat1b all(image.size(), uchar{255});
  const auto same = compare_images(image, image, all);
  ASSERT_TRUE(same);
  EXPECT_GT(same->psnr_db, 100.0);
  EXPECT_LT(same->median_offset_px, 0.001);

  cv::Mat3b moved;
  const cv::Matx23d shift(1, 0, 1.25, 0, 1, -0.5);
  cv::warpAffine(image, moved, shift, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  const auto compared = compare_images(image, moved, all);
  ASSERT_TRUE(compared);
  EXPECT_NEAR(compared->median_offset_px, std::hypot(1.25, 0.5), 0.05);
  EXPECT_GT(compared->patches, 20);
}

TEST(CompareTest, incomparableImagesAreNamed) {
  const cv::Mat3b image = noise_image(3);
  const cv::Mat3b other(10, 10);
  EXPECT_EQ(compare_images(image, other, cv::Mat1b(10, 10)).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(compare_images(image, image, cv::Mat1b(image.size(), uchar{0})).error().code, ErrorCode::degenerate);
  const auto flat =
      compare_images(cv::Mat3b(image.size(), cv::Vec3b(9, 9, 9)), image, cv::Mat1b(image.size(), uchar{255}));
  EXPECT_EQ(flat->patches, 0);
  EXPECT_TRUE(std::isnan(flat->median_offset_px));
}

}  // namespace
}  // namespace scanrig
