#include "pipeline/texture/texture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/parallel.h"
#include "pipeline/texture/image_difference.h"
#include "pipeline/texture/render.h"
#include "tests/unit/pipeline/texture/painted_scene.h"

namespace scanrig {
namespace {

using namespace testing;
constexpr double kElevation = 22.0 * std::numbers::pi / 180.0;
constexpr double kScale = 0.5;  // of the rig's resolution: 0.3 mm a pixel

double lamp_at_the_left(const Eigen::Vector3d& normal) {
  const double facing = normal.dot(Eigen::Vector3d(-0.6, 0.5, 0.62).normalized());
  return 0.6 + 0.35 * facing + 0.15 * facing * facing;
}

PaintedScene striped_ball() {
  PaintedScene scene;
  scene.balls = {{{3.0, 45.0, -2.0}, 35.0}};
  scene.paint = [](std::size_t, const Eigen::Vector3d& p) { return striped(p); };
  scene.lamps = lamp_at_the_left;
  return scene;
}

PaintedScene white_ball() {
  PaintedScene scene = striped_ball();
  scene.paint = [](std::size_t, const Eigen::Vector3d&) { return Eigen::Vector3d(0.5, 0.5, 0.5); };
  return scene;
}

const std::vector<Photo>& striped_photos() {
  static const auto photos = striped_ball().photos(rig_camera(0.0, kElevation, kScale), turns(8));
  return photos;
}

const std::vector<Photo>& white_photos() {
  static const auto photos = white_ball().photos(rig_camera(0.0, kElevation, kScale), turns(6));
  return photos;
}

TextureOptions small_atlas() { return {.atlas_px = 1024}; }

/// Green of the vertices whose direction from `centre` has a cosine in this range with `axis`.
std::vector<double> greens(const TexturedModel& model, const Eigen::Vector3f& centre, const Eigen::Vector3f& axis,
                           float min_cosine, float max_cosine) {
  std::vector<double> found;
  for (std::size_t v = 0; v < model.mesh.mesh.vertices.size(); ++v) {
    const float cosine = (model.mesh.mesh.vertices[v] - centre).normalized().dot(axis);
    if (cosine >= min_cosine && cosine <= max_cosine) found.push_back(model.mesh.mesh.colour[v][1]);
  }
  return found;
}

TEST(TextureTest, aModelLooksTheSameFromACameraThatTookNoPhoto) {
  const PaintedScene scene = striped_ball();
  const auto model = texture_mesh(scene.mesh(0.5), striped_photos(), {}, {});
  ASSERT_TRUE(model) << model.error().message;
  const auto renderer = MeshRenderer::create(model->mesh);
  ASSERT_TRUE(renderer);
  for (const double azimuth : {0.3, -0.2}) {
    const Photo truth = scene.photo(rig_camera(azimuth, kElevation + 0.1, kScale), 2.3);
    const auto seen = renderer->render(truth.camera, truth.turntable_from_model,
                                       {.supersample = 3, .as_photo = Exposure{model->light, model->exposure_gain}});
    ASSERT_TRUE(seen);
    const auto compared = compare_images(seen->image, truth.image, seen->mask);
    ASSERT_TRUE(compared);
    EXPECT_GT(compared->psnr_db, 42.0);
    EXPECT_GT(compared->patches, 20);
    EXPECT_LT(compared->median_offset_px, 0.05);
    EXPECT_LT(compared->p95_offset_px, 0.25);
  }
}

TEST(TextureTest, theLampsAreTakenOutOfThePaint) {
  const auto model = texture_mesh(white_ball().mesh(1.5), white_photos(), small_atlas(), {});
  ASSERT_TRUE(model);
  // Around a parallel: light that depends on height alone cannot be separated from paint while the ball only turns.
  const auto parallel = greens(*model, {3, 45, -2}, {0, 1, 0}, 0.15F, 0.2F);
  const auto [least, most] = std::minmax_element(parallel.begin(), parallel.end());
  EXPECT_LE(*most - *least, 4.0) << "between photos the light on it changes by a factor of 2";
}

TEST(TextureTest, theBrightestPaintBecomesASuitableWhite) {
  const auto model = texture_mesh(white_ball().mesh(1.5), white_photos(), small_atlas(), {});
  ASSERT_TRUE(model);
  const auto all = greens(*model, {3, 45, -2}, {0, 1, 0}, -1.0F, 1.0F);
  EXPECT_NEAR(*std::max_element(all.begin(), all.end()), 231.0, 4.0) << "sRGB of 0.8";
}

TEST(TextureTest, unseenSurfaceIsFilledFromAroundIt) {
  const std::vector<Photo> one(white_photos().begin(), white_photos().begin() + 1);
  const auto model = texture_mesh(white_ball().mesh(1.5), one, small_atlas(), {});
  ASSERT_TRUE(model);
  EXPECT_GT(model->seen_share, 0.25);
  EXPECT_LT(model->seen_share, 0.5);
  const auto behind = greens(*model, {3, 45, -2}, {0, 0, 1}, -1.0F, -0.5F);
  const auto front = greens(*model, {3, 45, -2}, {0, 0, 1}, -0.1F, 1.0F);
  const auto [darkest, brightest] = std::minmax_element(front.begin(), front.end());
  EXPECT_GE(*std::min_element(behind.begin(), behind.end()), *darkest - 1.0);
  EXPECT_LE(*std::max_element(behind.begin(), behind.end()), *brightest + 1.0);
}

TEST(TextureTest, paintOfAFrontObjectDoesNotLandOnTheOneBehind) {
  PaintedScene scene;
  scene.balls = {{{0.0, 45.0, -15.0}, 25.0}, {{4.0, 45.0, 30.0}, 8.0}};
  scene.paint = [](std::size_t ball, const Eigen::Vector3d&) {
    return ball == 0 ? Eigen::Vector3d(0.1, 0.5, 0.1) : Eigen::Vector3d(0.1, 0.1, 0.6);
  };
  const auto photos = scene.photos(rig_camera(0.0, kElevation, kScale), {-0.25, 0.0, 0.25});
  const auto model = texture_mesh(scene.mesh(1.0), photos, small_atlas(), {});
  ASSERT_TRUE(model);
  for (std::size_t v = 0; v < model->mesh.mesh.vertices.size(); ++v) {
    const bool far_one = (model->mesh.mesh.vertices[v] - Eigen::Vector3f(0, 45, -15)).norm() < 26.0F;
    const auto& [red, green, blue] = model->mesh.mesh.colour[v];
    ASSERT_EQ(far_one, green > red) << model->mesh.mesh.vertices[v].transpose();
    ASSERT_LT(blue, std::max(red, green)) << "the backdrop is blue";
  }
}

TEST(TextureTest, aHighlightInOnePhotoIsNotPaint) {
  auto photos = white_photos();
  photos[0].image = photos[0].image.clone();
  const Eigen::Vector3d spot = Eigen::Vector3d(3, 45, -2) + 35.0 * Eigen::Vector3d(0.0, 0.4, 1.0).normalized();
  const Eigen::Vector2d at = photos[0].camera.project(spot);
  cv::circle(photos[0].image, {static_cast<int>(at.x()), static_cast<int>(at.y())}, 12, {255, 255, 255}, cv::FILLED);
  const auto model = texture_mesh(white_ball().mesh(1.5), photos, small_atlas(), {});
  const auto clean = texture_mesh(white_ball().mesh(1.5), white_photos(), small_atlas(), {});
  ASSERT_TRUE(model && clean);
  for (std::size_t v = 0; v < clean->mesh.mesh.colour.size(); ++v) {
    ASSERT_NEAR(model->mesh.mesh.colour[v][1], clean->mesh.mesh.colour[v][1], 4) << v;
  }
}

TEST(TextureTest, anyNumberOfThreadsGivesTheSameBits) {
  const Mesh mesh = striped_ball().mesh(1.0);
  Result<TexturedModel> one = fail(ErrorCode::internal, "not run");
  Result<TexturedModel> three = one;
  with_threads(1, [&] { one = texture_mesh(mesh, striped_photos(), small_atlas(), {}); });
  with_threads(3, [&] { three = texture_mesh(mesh, striped_photos(), small_atlas(), {}); });
  ASSERT_TRUE(one && three);
  EXPECT_EQ(cv::norm(one->mesh.atlas, three->mesh.atlas, cv::NORM_INF), 0.0);
  EXPECT_EQ(one->mesh.corner_uv, three->mesh.corner_uv);
  EXPECT_EQ(one->mesh.mesh.colour, three->mesh.mesh.colour);
}

TEST(TextureTest, theChartsAreFewAndFillTheAtlasAtTheScaleThatFits) {
  const auto model = texture_mesh(striped_ball().mesh(1.0), striped_photos(), {.atlas_px = 512}, {});
  ASSERT_TRUE(model);
  EXPECT_LT(model->charts, 20u);
  EXPECT_LT(model->texels_per_px, 2.0);
  EXPECT_GT(model->texels_per_px, 0.8);
  ASSERT_EQ(model->mesh.corner_uv.size(), model->mesh.mesh.faces.size());
  for (const auto& corners : model->mesh.corner_uv) {
    for (const auto& uv : corners) {
      ASSERT_GE(uv.minCoeff(), 0.0F);
      ASSERT_LE(uv.maxCoeff(), 1.0F);
    }
  }
}

/// Texels of the faces themselves.
cv::Mat1b texels_of_faces(const TexturedMesh& mesh) {
  cv::Mat1b drawn(mesh.atlas.size(), uchar{0});
  for (const auto& uv : mesh.corner_uv) {
    std::array<cv::Point, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = cv::Point(static_cast<int>(std::lround(uv[k].x() * static_cast<float>(drawn.cols) - 0.5F)),
                             static_cast<int>(std::lround(uv[k].y() * static_cast<float>(drawn.rows) - 0.5F)));
    }
    cv::fillConvexPoly(drawn, corners, cv::Scalar(255));
  }
  return drawn;
}

TEST(TextureTest, theColourOfAChartContinuesAroundIt) {
  PaintedScene scene = white_ball();
  scene.paint = [](std::size_t, const Eigen::Vector3d& p) {
    return Eigen::Vector3d::Constant(p.y() > 45.0 ? 0.7 : 0.1).eval();
  };
  const TextureOptions options = small_atlas();
  const auto model =
      texture_mesh(scene.mesh(1.5), scene.photos(rig_camera(0.0, kElevation, kScale), turns(6)), options, {});
  ASSERT_TRUE(model);
  const cv::Mat3b& atlas = model->mesh.atlas;
  const cv::Mat1b inner = texels_of_faces(model->mesh);
  const int reach = options.padding_px - 1;  // drawn faces may be a texel larger
  cv::Mat1b outer;
  cv::dilate(inner, outer, cv::Mat1b::ones(2 * reach + 1, 2 * reach + 1));
  int around = 0, unlike = 0;
  for (int y = 0; y < atlas.rows; ++y) {
    for (int x = 0; x < atlas.cols; ++x) {
      if (outer(y, x) == 0 || inner(y, x) != 0) continue;
      const cv::Rect box =
          cv::Rect(x - reach, y - reach, 2 * reach + 1, 2 * reach + 1) & cv::Rect({0, 0}, atlas.size());
      int difference = 255;
      for (int v = box.y; v < box.br().y; ++v) {
        for (int u = box.x; u < box.br().x; ++u) {
          if (inner(v, u) != 0) difference = std::min(difference, std::abs(atlas(v, u)[1] - atlas(y, x)[1]));
        }
      }
      ++around;
      unlike += difference > 15 ? 1 : 0;
    }
  }
  EXPECT_GT(around, 1000);
  EXPECT_LT(unlike, around / 100);
}

TEST(TextureTest, geometryStaysAsItWas) {
  const Mesh mesh = striped_ball().mesh(2.0);
  const auto model = texture_mesh(mesh, striped_photos(), small_atlas(), {});
  ASSERT_TRUE(model);
  EXPECT_EQ(model->mesh.mesh.vertices, mesh.vertices);
  EXPECT_EQ(model->mesh.mesh.faces, mesh.faces);
}

TEST(TextureTest, unsuitableInputIsNamed) {
  const Mesh mesh = striped_ball().mesh(5.0);
  const auto& photos = striped_photos();
  const auto code = [](const Result<TexturedModel>& model) {
    EXPECT_FALSE(model);
    return model ? ErrorCode::internal : model.error().code;
  };
  EXPECT_EQ(code(texture_mesh({}, photos, small_atlas(), {})), ErrorCode::degenerate);
  EXPECT_EQ(code(texture_mesh(mesh, {}, small_atlas(), {})), ErrorCode::invalid_input);
  EXPECT_EQ(code(texture_mesh(mesh, photos, {.atlas_px = 0}, {})), ErrorCode::invalid_input);
  EXPECT_EQ(code(texture_mesh(mesh, photos, {.max_incidence_deg = 90.0}, {})), ErrorCode::invalid_input);
  EXPECT_EQ(code(texture_mesh(mesh, photos, {.atlas_px = 16}, {})), ErrorCode::out_of_range);

  auto other_size = photos;
  other_size[2].camera.projection.width = 1280;
  EXPECT_EQ(code(texture_mesh(mesh, other_size, small_atlas(), {})), ErrorCode::invalid_input);
  auto turned_away = photos;
  for (Photo& photo : turned_away) photo.camera.camera_from_turntable.translation().x() += 1000.0;
  EXPECT_EQ(code(texture_mesh(mesh, turned_away, small_atlas(), {})), ErrorCode::degenerate);
  Mesh broken = mesh;
  broken.vertices[3].x() = std::nanf("");
  EXPECT_EQ(code(texture_mesh(broken, photos, small_atlas(), {})), ErrorCode::invalid_input);

  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(code(texture_mesh(mesh, photos, small_atlas(), {stop.get_token(), {}})), ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
