#include "tests/component/movement/shot_scene.h"

#include <bit>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "core/units.h"
#include "pipeline/storage/images.h"
#include "sim/scene/dot_pattern.h"
#include "sim/scene/image_sensor.h"
#include "sim/scene/polygonise.h"
#include "sim/scene/random.h"
#include "sim/scene/renderer.h"
#include "sim/scene/room_light.h"

namespace scanrig::sim {
namespace {

/// As the file has it up, over the axis, its lowest point on the table.
Transform put_down(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(v);
  Transform placement = Transform::Identity();
  placement.translation() = Eigen::Vector3d(-box.center().x(), -box.min().y(), -box.center().z());
  return placement;
}

/// Blurs each colour of the mosaic by itself.
cv::Mat blurred(const cv::Mat& mosaic, double sigma_px) {
  cv::Mat result = mosaic.clone();
  for (int y : {0, 1}) {
    for (int x : {0, 1}) {
      cv::Mat1f colour(mosaic.rows / 2, mosaic.cols / 2);
      const auto at = [&](const cv::Mat& all, int r, int c) {
        return const_cast<cv::Mat&>(all).ptr<float>(2 * r + y) + 2 * c + x;
      };
      for (int r = 0; r < colour.rows; ++r)
        for (int c = 0; c < colour.cols; ++c) colour(r, c) = *at(mosaic, r, c);
      cv::GaussianBlur(colour, colour, {}, sigma_px / 2, sigma_px / 2, cv::BORDER_REPLICATE);
      for (int r = 0; r < colour.rows; ++r)
        for (int c = 0; c < colour.cols; ++c) *at(result, r, c) = colour(r, c);
    }
  }
  return result;
}

/// Another sampling of the scene for each change, as no two exposures sample it alike; the same change gives the same
/// sampling.
std::uint64_t sampling_of(const Disturbance& since, bool left) {
  std::uint64_t seed = left ? 1 : 2;
  const auto stir = [&seed](double value) { seed = mix(seed, std::bit_cast<std::uint64_t>(value)); };
  for (const double value : since.object.matrix().reshaped()) stir(value);
  for (const double value : since.camera.matrix().reshaped()) stir(value);
  stir(since.table_deg);
  return seed;
}

}  // namespace

ShotScene::ShotScene(Object object, double image_scale)
    : object_(std::move(object)),
      image_scale_(image_scale),
      placement_(put_down(object_.mesh)),
      rig_(default_rig(image_scale)),
      rays_(object_.mesh) {}

cv::Mat ShotScene::look(const Disturbance& since, bool left) const {
  static const DotPattern dots;  // only the plain image is used
  const Transform placement = since.object * placement_;
  const RoomLight light(object_, rays_, placement);
  Eye eye = left ? rig_.left : rig_.right;
  eye.eye_from_turntable = since.camera * eye.eye_from_turntable;
  const Placed placed{object_, rays_, light, placement};
  const auto radiance =
      render(placed, eye, rig_.projector, dots, to_radians(since.table_deg), sampling_of(since, left));
  return through_lens(radiance.plain, image_scale_);
}

cv::Mat ShotScene::shoot(const cv::Mat& on_sensor, std::uint64_t noise, const Sensor& sensor) {
  cv::Mat light = sensor.light * (sensor.blur_px > 0 ? blurred(on_sensor, sensor.blur_px) : on_sensor);
  if (sensor.noise_grey > 0) {
    cv::Mat1f more(light.size());
    cv::RNG(mix(noise, 77)).fill(more, cv::RNG::NORMAL, 0.0, sensor.noise_grey / 255.0);
    light += more;
  }
  const cv::Mat raw = ImageSensor().expose(light, mix(noise, 5) | 1);
  const auto images = to_view_images({"BayerRG8", raw, raw, raw, raw}, {});
  if (!images) throw std::runtime_error(images.error().message);
  return images->left_plain;
}

Object pebble() {
  const auto field = [](const Eigen::Vector3d& p) {
    // An egg, 70 x 50 x 40 mm, blunter at one end.
    const double width = 1.0 + 0.004 * p.x();
    return 20.0 * (std::sqrt(std::pow(p.x() / 35.0, 2) + std::pow(p.y() / (20.0 * width), 2) +
                             std::pow(p.z() / (25.0 * width), 2)) -
                   1.0);
  };
  Object object;
  object.name = "pebble";
  object.mesh = polygonise(field, {{-38, -30, -34}, {38, 30, 34}}, 1.0, 2.0);
  object.normals = vertex_normals(object.mesh);
  object.colour = vertex_colour(std::vector<Eigen::Vector3f>(object.mesh.vertices.size(), {0.45F, 0.43F, 0.40F}),
                                object.mesh.triangles);
  return object;
}

}  // namespace scanrig::sim
