#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "tests/unit/pipeline/texture/painted_scene.h"
#include "pipeline/texture/compare.h"
#include "pipeline/texture/render.h"

namespace scanrig {
namespace {

using namespace testing;
constexpr double kPi = std::numbers::pi;
constexpr double kElevation = 22.0 * kPi / 180.0;

PaintedScene striped_ball() {
  PaintedScene scene;
  scene.balls = {{{3.0, 45.0, -2.0}, 35.0}};
  scene.paint = [](std::size_t, const Eigen::Vector3d& p) { return striped(p); };
  return scene;
}

double lamp_at_the_left(const Eigen::Vector3d& normal) {
  return 0.6 + 0.6 * std::max(0.0, normal.dot(Eigen::Vector3d(-0.6, 0.5, 0.62).normalized()));
}

TEST(TextureTest, aModelLooksTheSameFromACameraThatTookNoPhoto) {
  PaintedScene scene = striped_ball();
  if (!getenv("EVEN")) scene.lamps = lamp_at_the_left;
  const auto photos = scene.photos(rig_camera(0.0, kElevation, 0.5), turns(8));
  const auto start = std::chrono::steady_clock::now();
  auto model = texture_mesh(scene.mesh(0.5), photos, {}, {});
  ASSERT_TRUE(model) << model.error().message;
  printf("%.2f s charts %zu scale %.2f seen %.3f gain %.3f\n",
         std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), model->charts,
         model->texels_per_px, model->seen_share, model->exposure_gain);
  const auto truth = scene.photo(rig_camera(0.3, kElevation + 0.1, 0.5), 0.2);
  const auto renderer = MeshRenderer::create(model->mesh);
  const auto seen = renderer->render(truth.camera, truth.turntable_from_model,
                                     {.supersample = 3, .as_photo = Exposure{model->light, model->exposure_gain}});
  ASSERT_TRUE(seen);
  const auto c = compare_images(seen->image, truth.image, seen->mask);
  printf("psnr %.2f offset %.3f p95 %.3f n %d\n", c->psnr_db, c->median_offset_px, c->p95_offset_px, c->patches);
  cv::imwrite("/tmp/tx_render.png", seen->image);
  cv::imwrite("/tmp/tx_truth.png", truth.image);
  cv::imwrite("/tmp/tx_atlas.png", model->mesh.atlas);
}

}  // namespace
}  // namespace scanrig
