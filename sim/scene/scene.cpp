#include "sim/scene/scene.h"

#include <bit>
#include <cassert>
#include <opencv2/core.hpp>
#include <tuple>

#include "sim/scene/image_sensor.h"
#include "sim/scene/random.h"
#include "sim/scene/rests.h"

namespace scanrig::sim {

Result<std::unique_ptr<Scene>> Scene::create(const SceneOptions& options) {
  if (!(options.image_scale >= 0.1 && options.image_scale <= 1.0) || options.poses < 1) {
    return fail(ErrorCode::out_of_range, "scene: image scale {} and {} poses: choose 0.1 to 1 and at least one pose",
                options.image_scale, options.poses);
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
      rig_(options.rig ? draw_rig(*options.rig, options.image_scale)
                       : DrawnRig{.geometry = default_rig(options.image_scale)}),
      rays_(object_.mesh),
      dots_(options.image_scale),
      lights_(placements_.size()) {}

const RoomLight& Scene::light_of(int pose) {
  auto& light = lights_[pose];
  if (!light) light = std::make_unique<RoomLight>(object_, rays_, placements_[pose]);
  return *light;
}

Transform Scene::true_placement(int pose) const {
  return options_.rig ? Transform(rig_.table.axis_from_top * placements_[pose]) : placements_[pose];
}

View Scene::look(int pose, double angle) {
  assert(pose >= 0 && pose < static_cast<int>(placements_.size()));
  const Placed placed{object_, rays_, light_of(pose), placements_[pose], rig_.rim_dots};
  const RigGeometry rig = options_.rig ? against_table_motion(rig_.geometry, rig_.table, angle) : rig_.geometry;
  const auto seen_by = [&](const Eye& eye, int camera) {
    const std::uint64_t sampling = mix(static_cast<std::uint64_t>(pose), std::bit_cast<std::uint64_t>(angle), camera);
    const Radiance light = render(placed, eye, rig.projector, dots_, angle, sampling);
    const double scale = options_.image_scale;
    return std::pair(through_lens(light.pattern, scale), through_lens(light.plain, scale));
  };
  View view;
  std::tie(view.left_pattern, view.left_plain) = seen_by(rig.left, 0);
  std::tie(view.right_pattern, view.right_plain) = seen_by(rig.right, 1);
  return view;
}

StereoImages Scene::expose(const View& view, bool pattern, std::uint64_t exposure) const {
  const auto key = [&](int camera) { return options_.noise ? mix(options_.seed, exposure, camera) | 1 : 0; };
  return {sim::expose(pattern ? view.left_pattern : view.left_plain, key(0), rig_.noise_factor),
          sim::expose(pattern ? view.right_pattern : view.right_plain, key(1), rig_.noise_factor)};
}

StereoImages Scene::expose(const View& view, const LightLevels& lights, std::uint64_t exposure) const {
  const double dots = lights.is_slide_in ? lights.pattern : 0.0;
  const double even = lights.plain + (lights.is_slide_in ? 0.0 : lights.pattern);
  View mixed;
  cv::addWeighted(view.left_pattern, dots, view.left_plain, even, 0.0, mixed.left_pattern);
  cv::addWeighted(view.right_pattern, dots, view.right_plain, even, 0.0, mixed.right_pattern);
  return expose(mixed, true, exposure);
}

StereoImages Scene::shoot(int pose, double angle, bool pattern, std::uint64_t exposure) {
  if (pose != pose_ || angle != angle_) view_ = look(pose, angle);
  pose_ = pose;
  angle_ = angle;
  return expose(view_, pattern, exposure);
}

}  // namespace scanrig::sim
