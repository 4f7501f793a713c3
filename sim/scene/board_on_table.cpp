#include "sim/scene/board_on_table.h"

#include <cassert>

#include "core/units.h"
#include "sim/scene/image_sensor.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

enum class BoardRandom : std::uint8_t { print = 60, place, sampling, exposed, measured };

}  // namespace

BoardOnTable::BoardOnTable(const Scene& scene)
    : scene_(scene), board_(BoardLayout{}, PrintErrors{}, mix(scene.options().seed, BoardRandom::print)) {}

double BoardOnTable::measured_length_mm() const {
  const double length = (board_.corner(board_.layout().corner_columns() - 1) - board_.corner(0)).norm();
  return length + kLengthSigmaMm * normal(mix(scene_.options().seed, BoardRandom::measured));
}

void BoardOnTable::put(int number) {
  const PlannedPlacement& planned = calibration_plan().at(static_cast<std::size_t>(number) - 1);
  const double facing = -to_radians(scene_.drawn_rig().table.true_deg(-planned.mark_deg));
  placed_.emplace(board_,
                  put_down(planned, board_.layout(), facing, false, mix(scene_.options().seed, BoardRandom::place)),
                  scene_.drawn_rig().rim_dots);
}

StereoImages BoardOnTable::shoot(double angle, std::uint64_t exposure) {
  assert(placed_);
  const DrawnRig& rig = scene_.drawn_rig();
  const SceneOptions& options = scene_.options();
  const RigGeometry seen = options.rig ? against_table_motion(rig.geometry, rig.table, angle) : rig.geometry;
  const auto image = [&](const Eye& eye, int camera) {
    auto& rays = rays_[static_cast<std::size_t>(camera)];
    if (!rays) rays = std::make_unique<RayMap>(eye);
    const cv::Mat light =
        placed_->render(eye, *rays, angle, mix(options.seed, BoardRandom::sampling, exposure, camera));
    const std::uint64_t key = options.noise ? mix(options.seed, BoardRandom::exposed, exposure, camera) | 1 : 0;
    return expose(through_lens(light, options.image_scale), key, rig.noise_factor);
  };
  return {image(seen.left, 0), image(seen.right, 1)};
}

}  // namespace scanrig::sim
