#include "sim/scene/scene.h"

#include <bit>
#include <cassert>
#include <opencv2/core.hpp>
#include <tuple>

#include "core/units.h"
#include "sim/scene/random.h"
#include "sim/scene/rests.h"

namespace scanrig::sim {
namespace {

enum class LightRandom : std::uint8_t { flash = 90, room };

}  // namespace

Result<std::unique_ptr<Scene>> Scene::create(const SceneOptions& options) {
  if (!(options.image_scale >= kSmallestImageScale && options.image_scale <= kLargestImageScale) || options.poses < 1) {
    return fail(ErrorCode::out_of_range, "scene: image scale {} and {} poses: choose {} to {} and at least one pose",
                options.image_scale, options.poses, kSmallestImageScale, kLargestImageScale);
  }
  auto object = load_object(options.object, options.height_mm);
  if (!object) return pass_on(object);
  const auto materials = Materials::named(options.profile.material_name(), options.profile.effects);
  if (!materials) return pass_on(materials);
  object->materials = *materials;
  object->colour = materials->coloured(object->colour);
  auto placements = object->is_upright ? upright_placements(object->mesh, options.seed, options.poses, options.any_size)
                                       : draw_placements(object->mesh, options.seed, options.poses,
                                                         options.same_rest_twice, options.any_size);
  if (!placements) return pass_on(placements, object->name);
  auto scene = std::make_unique<Scene>(std::move(*object), std::move(*placements), options);
  if (auto held = scene->put_on_fixtures(); !held) return pass_on(held, scene->object().name);
  return scene;
}

Result<void> Scene::put_on_fixtures() {
  if (options_.fixture == FixtureKind::none) return {};
  for (std::size_t pose = 0; pose < placements_.size(); ++pose) {
    const std::uint64_t seed = mix(options_.seed, pose);
    auto held = hold(object_.mesh, rays_, placements_[pose], options_.fixture, seed);
    if (!held) return pass_on(held);
    placements_[pose] = held->table_from_object;
    held_.push_back(std::make_unique<Standing>(with_fixture(object_, held->fixture)));
  }
  return {};
}

Scene::Scene(Object object, std::vector<Transform> placements, const SceneOptions& options)
    : options_(options),
      object_(std::move(object)),
      placements_(std::move(placements)),
      rig_(make_rig(options.rig, options.profile.effects, options.image_scale)),
      rays_(object_.mesh),
      cameras_(both_cameras(options.profile, options.image_scale)),
      lights_(placements_.size()),
      bounces_(placements_.size()) {}

const DotPattern& Scene::dots() {
  if (!dots_) dots_ = std::make_unique<DotPattern>(options_.image_scale);
  return *dots_;
}

const RoomLight& Scene::light_of(int pose) {
  auto& light = lights_[pose];
  if (!light)
    light = std::make_unique<RoomLight>(object_in(pose), rays_in(pose), placements_[pose], options_.profile.screen);
  return *light;
}

const BouncePaths& Scene::bounces_of(int pose) {
  auto& paths = bounces_[pose];
  if (!paths)
    paths = std::make_unique<BouncePaths>(object_in(pose), rays_in(pose), placements_[pose], options_.profile.screen);
  return *paths;
}

const RayMap& Scene::rays_of(int camera) {
  auto& rays = ray_maps_[camera];
  if (!rays) rays = std::make_unique<RayMap>(camera == 0 ? rig_.geometry.left : rig_.geometry.right);
  return *rays;
}

Transform Scene::true_placement(int pose) const {
  return rig_.table.is_ideal() ? placements_[pose] : Transform(rig_.table.axis_from_top * placements_[pose]);
}

View Scene::look(int pose, double angle, double minutes) {
  assert(pose >= 0 && pose < static_cast<int>(placements_.size()));
  const Effects& effects = options_.profile.effects;
  const RigGeometry then = at_time(rig_.geometry, effects, options_.profile.is_cold ? WarmUp{minutes} : WarmUp{});
  const RigGeometry rig = rig_.table.is_ideal() ? then : against_table_motion(then, rig_.table, angle);
  ViewEffects added{.effects = effects,
                    .handling = options_.spoils_all ? Handling::all(effects)
                                                    : Handling::of_view(effects, options_.seed, options_.views, pose,
                                                                        to_degrees(angle)),
                    .colour = options_.profile.screen};
  const Object& object = object_in(pose);
  const RayCaster& rays = rays_in(pose);
  const Placed placed{object, rays, light_of(pose), added.handling.moved(placements_[pose]), rig_.rim_dots};
  std::optional<BounceLight> bounce;
  if (effects.interreflection > 0.0) {
    const Lamp lamp(rig.projector, dots(), effects, added.handling.finger);
    added.bounce = &bounce.emplace(bounces_of(pose), object, rays, lamp, Transform(rot_y(angle)));
  }
  std::optional<ScreenLight> screen;
  if (effects.folds > 0.0 || effects.screen_shadow > 0.0) {
    added.screen = &screen.emplace(effects, object, rays, light_of(pose), rot_y(angle) * placements_[pose]);
  }
  const auto seen_by = [&](const Eye& eye, int camera) {
    const std::uint64_t sampling = mix(static_cast<std::uint64_t>(pose), std::bit_cast<std::uint64_t>(angle), camera);
    if (!effects.is_none()) added.rays = &rays_of(camera);
    Radiance light = render(placed, eye, rig.projector, dots(), angle, sampling, added);
    if (added.handling.overexposed > 0.0) {
      light.pattern *= 1.0 + added.handling.overexposed;
      light.plain *= 1.0 + added.handling.overexposed;
    }
    const Lens& lens = cameras_[camera].lens;
    return std::pair(lens.image(light.pattern), lens.image(light.plain));
  };
  View view;
  std::tie(view.left_pattern, view.left_plain) = seen_by(rig.left, 0);
  std::tie(view.right_pattern, view.right_plain) = seen_by(rig.right, 1);
  return view;
}

cv::Mat Scene::exposed(const cv::Mat& on_sensor, int camera, std::uint64_t exposure) const {
  const std::uint64_t key = options_.noise ? mix(options_.seed, exposure, camera) | 1 : 0;
  return cameras_[camera].sensor.expose(on_sensor, key, rig_.noise_factor);
}

StereoImages Scene::expose(const View& view, bool pattern, std::uint64_t exposure) const {
  const Effects& effects = options_.profile.effects;
  if (effects.flash > 0.0 || effects.flicker > 0.0 || effects.room_light > 0.0)
    return expose(view, pattern ? LightLevels{.pattern = 1.0} : LightLevels{.plain = 1.0}, exposure);
  return {exposed(pattern ? view.left_pattern : view.left_plain, 0, exposure),
          exposed(pattern ? view.right_pattern : view.right_plain, 1, exposure)};
}

StereoImages Scene::expose(const View& view, const LightLevels& lights, std::uint64_t exposure) const {
  const Effects& effects = options_.profile.effects;
  const double flash = 1.0 + effects.flash * normal(mix(options_.seed, exposure, LightRandom::flash)),
               room = 1.0 + effects.flicker * normal(mix(options_.seed, exposure, LightRandom::room));
  const double slide = lights.is_slide_in ? lights.pattern : 0.0;
  // The pattern's exposure has the room's light in it, which does not follow the flash.
  const double dots = effects.pattern_exposure * slide * flash;
  const double in_dots =
      effects.pattern_exposure * slide * (profile().pattern_room_light * (room - flash) + effects.room_light * room);
  const double even = room * (lights.plain + (lights.is_slide_in ? 0.0 : lights.pattern)) + in_dots;
  const auto mixed = [&](const cv::Mat& pattern, const cv::Mat& plain) {
    cv::Mat light;
    cv::addWeighted(pattern, dots, plain, even, 0.0, light);
    return light;
  };
  return {exposed(mixed(view.left_pattern, view.left_plain), 0, exposure),
          exposed(mixed(view.right_pattern, view.right_plain), 1, exposure)};
}

StereoImages Scene::shoot(int pose, double angle, bool pattern, std::uint64_t exposure, double minutes,
                          double duration) {
  if (!options_.profile.is_cold) minutes = 0.0;
  if (pose != pose_ || angle != angle_ || minutes != minutes_) view_ = look(pose, angle, minutes);
  pose_ = pose;
  angle_ = angle;
  minutes_ = minutes;
  if (duration == 1.0) return expose(view_, pattern, exposure);
  return expose(view_, pattern ? LightLevels{.pattern = duration} : LightLevels{.plain = duration}, exposure);
}

}  // namespace scanrig::sim
