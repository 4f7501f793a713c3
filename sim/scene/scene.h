#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "core/result.h"
#include "sim/scene/camera_model.h"
#include "sim/scene/fixture.h"
#include "sim/scene/object.h"
#include "sim/scene/optics.h"
#include "sim/scene/renderer.h"
#include "sim/scene/rig_effects.h"

namespace scanrig::sim {

struct SceneOptions {
  std::filesystem::path object;  ///< OBJ, PLY or GLB, or an artefact's name; empty: the built-in figurine
  double height_mm = 100.0;      ///< see load_object
  std::uint64_t seed = 1;        ///< placements and noise
  int poses = 2;
  double image_scale = 1.0;
  bool same_rest_twice = false;  ///< every pose is the first rest, only turned and moved
  bool any_size = false;         ///< put it down although it is larger than the working volume, as an operator can
  FixtureKind fixture = FixtureKind::none;  ///< every pose leans on one; the truth is the object alone
  bool noise = true;
  std::optional<RigVariation> rig = std::nullopt;  ///< a drawn rig; nothing: the default rig, without any error
  ChosenProfile profile{};                         ///< as declared: profile 1
  int views = 8;                                   ///< per pose: which of them handling spoils
  bool spoils_all = false;                         ///< handling spoils every view: a source of single ones
};

/// Left and right image of one exposure, 8 bit BayerRG8.
struct StereoImages {
  cv::Mat left;
  cv::Mat right;
};

/// The light on both sensors, in both lights; see through_lens().
struct View {
  cv::Mat left_pattern, right_pattern, left_plain, right_plain;
};

/// Mixture of lights in an exposure, as shares of those of a sound rig.
struct LightLevels {
  double pattern = 0.0;
  double plain = 0.0;
  bool is_slide_in = true;  ///< without the slide the pattern's lamp gives plain light
};

/// The object in all its poses under the default rig, or a drawn one.
/// Threads: look() and shoot() one at a time, the rest from any.
class Scene {
 public:
  static constexpr std::uint64_t kFirstPreview = std::uint64_t{1} << 32;

  /// Fails as load_object, draw_placements, hold and Materials::named, and with `out_of_range` (image_scale outside its
  /// limits, poses below 1).
  static Result<std::unique_ptr<Scene>> create(const SceneOptions& options);
  /// For tests: a given object in given placements.
  Scene(Object object, std::vector<Transform> placements, const SceneOptions& options);

  /// The scene with the table at the true `angle` (radians), `minutes` after the first exposure. Same arguments, same
  /// bits. Takes about 2 s in full size, with the effects of profile 2 about 5 s.
  View look(int pose, double angle, double minutes = 0.0);
  /// `exposure` counts exposures, previews from kFirstPreview; with the seed it names the noise.
  [[nodiscard]] StereoImages expose(const View& view, bool pattern, std::uint64_t exposure) const;
  /// The same in any mixture of lights.
  [[nodiscard]] StereoImages expose(const View& view, const LightLevels& lights, std::uint64_t exposure) const;
  /// Both; the second light of the same pose and angle costs next to nothing.
  /// `duration`: of the exposure, as a multiple of the usual one.
  StereoImages shoot(int pose, double angle, bool pattern, std::uint64_t exposure, double minutes = 0.0,
                     double duration = 1.0);

  [[nodiscard]] const Object& object() const { return object_; }
  [[nodiscard]] const RigGeometry& rig() const { return rig_.geometry; }
  [[nodiscard]] const DrawnRig& drawn_rig() const { return rig_; }
  [[nodiscard]] const SceneOptions& options() const { return options_; }
  /// table_from_object of each pose, on the table top; see true_placement().
  [[nodiscard]] const std::vector<Transform>& placements() const { return placements_; }
  /// The same with the table top's tilt: in the frame that turns about the axis.
  [[nodiscard]] Transform true_placement(int pose) const;

 private:
  /// What stands on the table.
  struct Standing {
    Object object;
    RayCaster rays;
    explicit Standing(Object o) : object(std::move(o)), rays(object.mesh) {}
  };
  Result<void> put_on_fixtures();
  [[nodiscard]] const Object& object_in(int pose) const { return held_.empty() ? object_ : held_[pose]->object; }
  [[nodiscard]] const RayCaster& rays_in(int pose) const { return held_.empty() ? rays_ : held_[pose]->rays; }
  const DotPattern& dots();
  const RoomLight& light_of(int pose);
  const BouncePaths& bounces_of(int pose);
  const RayMap& rays_of(int camera);
  [[nodiscard]] cv::Mat exposed(const cv::Mat& on_sensor, int camera, std::uint64_t exposure) const;

  SceneOptions options_;
  Object object_;
  std::vector<Transform> placements_;
  DrawnRig rig_;
  RayCaster rays_;
  std::vector<std::unique_ptr<Standing>> held_;  ///< of each pose; empty: no fixtures
  std::array<CameraModel, 2> cameras_;
  std::unique_ptr<DotPattern> dots_;                   // made at the first look
  std::vector<std::unique_ptr<RoomLight>> lights_;     // made when a pose is first seen
  std::vector<std::unique_ptr<BouncePaths>> bounces_;  // likewise
  std::array<std::unique_ptr<RayMap>, 2> ray_maps_;

  // The last thing shot.
  int pose_ = -1;
  double angle_ = 0.0, minutes_ = 0.0;
  View view_;
};

}  // namespace scanrig::sim
