#include "sim/scene/board_on_table.h"

#include <cassert>

#include "core/units.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

enum class BoardRandom : std::uint8_t { print = 60, place, sampling, exposed, measured };

}  // namespace

BoardOnTable::BoardOnTable(const Scene& scene)
    : scene_(scene),
      rig_(make_rig(scene.options().rig, scene.options().profile.effects, scene.options().image_scale)),
      cameras_(both_cameras(scene.options().profile, scene.options().image_scale)),
      board_(BoardLayout{}, PrintErrors{}, mix(scene.options().seed, BoardRandom::print)) {}

double BoardOnTable::measured_length_mm() const {
  const double length = (board_.corner(board_.layout().corner_columns() - 1) - board_.corner(0)).norm();
  return length + kLengthSigmaMm * normal(mix(scene_.options().seed, BoardRandom::measured));
}

void BoardOnTable::put(int number) {
  const PlannedPlacement& planned = calibration_plan().at(static_cast<std::size_t>(number) - 1);
  const double facing = -to_radians(rig_.table.true_deg(-planned.mark_deg));
  const PlacedBoard placed =
      sunk(put_down(planned, board_.layout(), facing, false, mix(scene_.options().seed, BoardRandom::place)),
           scene_.options().profile.effects.top_height_mm);
  placed_.emplace(board_, placed, rig_.rim_dots);
}

StereoImages BoardOnTable::shoot(double angle, std::uint64_t exposure) {
  assert(placed_);
  const SceneOptions& options = scene_.options();
  const RigGeometry seen =
      rig_.table.is_ideal() ? rig_.geometry : against_table_motion(rig_.geometry, rig_.table, angle);
  const auto image = [&](const Eye& eye, int camera) {
    auto& rays = rays_[static_cast<std::size_t>(camera)];
    if (!rays) rays = std::make_unique<RayMap>(eye);
    const cv::Mat light =
        placed_->render(eye, *rays, angle, mix(options.seed, BoardRandom::sampling, exposure, camera));
    const std::uint64_t key = options.noise ? mix(options.seed, BoardRandom::exposed, exposure, camera) | 1 : 0;
    const CameraModel& model = cameras_[static_cast<std::size_t>(camera)];
    return model.sensor.expose(model.lens.image(light), key, rig_.noise_factor);
  };
  return {image(seen.left, 0), image(seen.right, 1)};
}

}  // namespace scanrig::sim
