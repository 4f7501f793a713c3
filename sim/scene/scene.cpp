#include "sim/scene/scene.h"

#include <cassert>

#include "sim/scene/random.h"
#include "sim/scene/rests.h"
#include "sim/scene/sensor.h"

namespace scanrig::sim {

Result<std::unique_ptr<Scene>> Scene::create(const SceneOptions& options) {
  if (!(options.image_scale >= 0.1 && options.image_scale <= 1.0) || options.poses < 1) {
    return fail(ErrorCode::out_of_range,
                "scene: image scale {} and {} poses: 0.1 to 1 and at least one pose are possible", options.image_scale,
                options.poses);
  }
  auto object = load_object(options.object, options.height_mm);
  if (!object) return pass_on(object);
  auto placements =
      draw_placements(object->mesh, options.seed, options.poses, options.same_rest_twice, options.any_size);
  if (!placements) return pass_on(placements, object->name);
  return std::make_unique<Scene>(std::move(*object), std::move(*placements), options);
}

Scene::Scene(Object object, std::vector<Transform> placements, const SceneOptions& options)
    : options_(options),
      object_(std::move(object)),
      placements_(std::move(placements)),
      rig_(default_rig(options.image_scale)),
      rays_(object_.mesh),
      dots_(options.image_scale),
      lights_(placements_.size()) {}

const RoomLight& Scene::light_of(int pose) {
  auto& light = lights_[pose];
  if (!light) light = std::make_unique<RoomLight>(object_, rays_, placements_[pose]);
  return *light;
}

StereoImages Scene::shoot(int pose, double angle, bool pattern, std::uint64_t exposure) {
  assert(pose >= 0 && pose < static_cast<int>(placements_.size()));
  if (pose != pose_ || angle != angle_) {
    const Placed placed{object_, rays_, light_of(pose), placements_[pose]};
    left_ = render(placed, rig_.left, rig_.projector, dots_, angle, mix(exposure, 0));
    right_ = render(placed, rig_.right, rig_.projector, dots_, angle, mix(exposure, 1));
    pose_ = pose;
    angle_ = angle;
  }
  const auto key = [&](int camera) { return options_.noise ? mix(options_.seed, exposure, camera) | 1 : 0; };
  const double scale = options_.image_scale;
  return {expose(pattern ? left_.pattern : left_.plain, scale, key(0)),
          expose(pattern ? right_.pattern : right_.plain, scale, key(1))};
}

}  // namespace scanrig::sim
