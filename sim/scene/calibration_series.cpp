#include "sim/scene/calibration_series.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/units.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/rest_error.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

enum class SeriesRandom : std::uint8_t {
  print = 40,
  place,
  knock,
  focus,
  blurred,
  slip,
  sampling,
  exposure,
  cold,
  cut_off
};

constexpr double kMinutesPerPair = 0.25;

bool can_be_made(const BoardLayout& b) {
  const bool markers = b.marker_mm > 0.0;
  return b.columns >= 3 && b.rows >= 3 && b.columns <= 40 && b.rows <= 40 && b.square_mm > 0.0 && b.margin_mm >= 0.0 &&
         b.thickness_mm > 0.0 && b.marker_mm >= 0.0 && b.marker_mm < b.square_mm &&
         (!markers || (b.rows % 2 == 1 && b.marker_count() <= 100)) &&
         std::hypot(b.width(), b.height()) < 2.0 * profile().table_radius_mm;
}

/// The number of the placement after which a fault occurs: 2 to 5, of those that are taken but the last.
int placement_before(const std::vector<SeriesPair>& pairs, std::uint64_t bits) {
  std::set<int> taken;
  for (const auto& pair : pairs) taken.insert(pair.placement);
  std::vector<int> possible;
  for (const int number : taken) {
    if (number >= 2 && number <= 5 && number != *taken.rbegin()) possible.push_back(number);
  }
  return possible.empty() ? *taken.begin() : possible[bits % possible.size()];
}

}  // namespace

Result<std::unique_ptr<CalibrationSeries>> CalibrationSeries::create(const SeriesOptions& o) {
  if (!(o.image_scale >= kSmallestImageScale && o.image_scale <= kLargestImageScale)) {
    return fail(ErrorCode::out_of_range, "series: image scale {}: choose {} to {}", o.image_scale, kSmallestImageScale,
                kLargestImageScale);
  }
  if (!can_be_made(o.board)) {
    return fail(
        ErrorCode::out_of_range,
        "series: a board of {}x{} squares of {} mm with markers of {} mm: choose 3 to 40 squares, an odd number "
        "of rows and at most 200 squares with markers, and a board smaller than the table",
        o.board.columns, o.board.rows, o.board.square_mm, o.board.marker_mm);
  }
  if (o.angles < 1 || o.angles > 99 || o.hand_held < 0 || o.hand_held > 999) {
    return fail(ErrorCode::out_of_range, "series: {} angles and {} hand-held pairs: choose 1 to 99 and 0 to 999",
                o.angles, o.hand_held);
  }
  for (const int number : o.placements) {
    if (number < 1 || number > static_cast<int>(calibration_plan().size())) {
      return fail(ErrorCode::out_of_range, "series: no placement {}: choose 1 to {}", number,
                  calibration_plan().size());
    }
  }
  return std::unique_ptr<CalibrationSeries>(new CalibrationSeries(o));
}

CalibrationSeries::CalibrationSeries(const SeriesOptions& o)
    : options_(o),
      rig_(make_rig(o.rig, o.profile.effects, o.image_scale)),
      cameras_(both_cameras(o.profile, o.image_scale)),
      board_(o.board, o.print, mix(o.seed, SeriesRandom::print)) {
  if (o.hand_held > 0) {
    plan_hand_held();
  } else {
    plan_placements();
  }
  add_faults();
}

void CalibrationSeries::plan_placements() {
  for (const auto& planned : calibration_plan()) {
    const auto& chosen = options_.placements;
    if (!chosen.empty() && std::ranges::find(chosen, planned.number) == chosen.end()) continue;
    const double facing = -to_radians(rig_.table.true_deg(-planned.mark_deg));
    const PlacedBoard placed = sunk(
        put_down(planned, options_.board, facing, options_.exact_placements, mix(options_.seed, SeriesRandom::place)),
        options_.profile.effects.top_height_mm);
    int image = 0;
    for (const double angle : planned_angles(planned, options_.angles)) {
      SeriesPair pair;
      pair.placement = planned.number;
      pair.image = ++image;
      pair.name = fmt::format("placement{}_{:02}", planned.number, image);
      pair.in_a = planned.in_a;
      pair.in_b = planned.in_b;
      const double rest = resting_angle(angle, mix(options_.seed, SeriesRandom::place));
      pair.reported_deg = encoder_reading(rest);
      pair.true_deg = rig_.table.true_deg(rest);
      pair.table_from_board = rig_.table.axis_from_top * placed.table_from_board;
      pair.rig = rig_.geometry;
      pairs_.push_back(pair);
      placed_.push_back(placed);
    }
  }
}

void CalibrationSeries::plan_hand_held() {
  for (int number = 1; number <= options_.hand_held; ++number) {
    SeriesPair pair;
    pair.placement = number;
    pair.name = fmt::format("hand{:03}", number);
    placed_.push_back(held_by_hand(mix(options_.seed, SeriesRandom::place), number));
    pair.table_from_board = rig_.table.axis_from_top * placed_.back().table_from_board;
    pair.rig = rig_.geometry;
    pairs_.push_back(pair);
  }
}

void CalibrationSeries::add_faults() {
  change_cameras();
  for (std::size_t i = 0; i < pairs_.size() && options_.profile.is_cold; ++i)
    pairs_[i].rig = at_time(pairs_[i].rig, options_.profile.effects, {static_cast<double>(i) * kMinutesPerPair});
  const SeriesFaults& f = options_.faults;
  const auto bits = [&](int n) { return mix(options_.seed, SeriesRandom::blurred, n); };
  for (int i = 0; i < static_cast<int>(f.blurred); ++i) {
    SeriesPair& pair = pairs_[bits(2 * i) % pairs_.size()];
    (bits(2 * i + 1) % 2 == 0 ? pair.left_blur_px : pair.right_blur_px) = 2.5;
  }
  move_boards();
}

void CalibrationSeries::change_cameras() {
  const SeriesFaults& f = options_.faults;
  const auto bits = [&](SeriesRandom purpose, int n) { return mix(options_.seed, purpose, n); };
  const auto eye_of = [](SeriesPair& pair, bool left) -> Eye& { return left ? pair.rig.left : pair.rig.right; };
  const auto turn = [&](Eye& eye, double px, double way) {
    const double angle = px * options_.image_scale / eye.fx;
    eye.eye_from_turntable =
        small_motion(angle * Vector3d(std::sin(way), std::cos(way), 0.0), Vector3d::Zero()) * eye.eye_from_turntable;
  };
  const int knocked_after = placement_before(pairs_, bits(SeriesRandom::knock, 0)),
            focused_after = placement_before(pairs_, bits(SeriesRandom::focus, 0));
  const double knocked_way = 2.0 * M_PI * uniform(bits(SeriesRandom::knock, 1)),
               cold_way = 2.0 * M_PI * uniform(bits(SeriesRandom::cold, 1));
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    SeriesPair& pair = pairs_[i];
    if (f.knock_px != 0.0 && pair.placement > knocked_after) {
      turn(eye_of(pair, bits(SeriesRandom::knock, 2) % 2 == 0), f.knock_px, knocked_way);
    }
    if (f.cold_px != 0.0) {
      const double progress = static_cast<double>(i) / static_cast<double>(pairs_.size() - 1);
      turn(eye_of(pair, bits(SeriesRandom::cold, 2) % 2 == 0), progress * f.cold_px, cold_way);
    }
    if (f.focus != 0.0 && pair.placement > focused_after) {
      const bool left = bits(SeriesRandom::focus, 1) % 2 == 0;
      eye_of(pair, left).fx *= 1.0 + f.focus;
      eye_of(pair, left).fy *= 1.0 + f.focus;
      (left ? pair.left_blur_px : pair.right_blur_px) = 0.6;
    }
  }
}

void CalibrationSeries::move_boards() {
  const SeriesFaults& f = options_.faults;
  const auto move = [&](std::size_t i, const Vector3d& shift) {
    placed_[i].table_from_board = Transform(Eigen::Translation3d(shift)) * placed_[i].table_from_board;
    pairs_[i].table_from_board = rig_.table.axis_from_top * placed_[i].table_from_board;
  };
  const auto one_of = [&](SeriesRandom purpose) {
    return pairs_[mix(options_.seed, purpose, 0) % pairs_.size()].placement;
  };
  const int slipped = one_of(SeriesRandom::slip), aside = one_of(SeriesRandom::cut_off);
  const double direction = 2.0 * M_PI * uniform(mix(options_.seed, SeriesRandom::slip, 1));
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (f.slip_mm != 0.0 && pairs_[i].placement == slipped && pairs_[i].image > (options_.angles + 1) / 2) {
      move(i, f.slip_mm * Vector3d(std::sin(direction), 0.0, std::cos(direction)));
    }
    if (f.cut_off_mm != 0.0 && pairs_[i].placement == aside) {
      move(i, f.cut_off_mm * placed_[i].table_from_board.linear().col(0));
    }
  }
}

Transform CalibrationSeries::table_motion(const SeriesPair& pair) const { return rig_.table.motion(pair.true_deg); }

Vector2d CalibrationSeries::corner_pixel(const SeriesPair& pair, bool left, int id) const {
  const Transform turntable_from_board = table_motion(pair) * rot_y(to_radians(pair.true_deg)) * pair.table_from_board;
  return (left ? pair.rig.left : pair.rig.right).project(turntable_from_board * board_.corner(id));
}

StereoImages CalibrationSeries::shoot(std::size_t index) {
  const SeriesPair& pair = pairs_[index];
  const bool same_scene = scene_ && pairs_[scene_of_].placement == pair.placement &&
                          pairs_[scene_of_].table_from_board.isApprox(pair.table_from_board, 0.0);
  if (!same_scene) {
    scene_ = std::make_unique<BoardScene>(board_, placed_[index], rig_.rim_dots);
    scene_of_ = index;
  }
  const double angle = to_radians(pair.true_deg);
  const RigGeometry seen = against_table_motion(pair.rig, rig_.table, angle);
  const auto image = [&](const Eye& eye, int camera, double blur) {
    auto& rays = rays_[camera];
    if (!rays || rays->fx != eye.fx) rays = std::make_unique<Rays>(Rays{eye.fx, RayMap(eye)});
    const cv::Mat light =
        scene_->render(eye, rays->map, angle, mix(options_.seed, SeriesRandom::sampling, index, camera));
    const std::uint64_t key = options_.noise ? mix(options_.seed, SeriesRandom::exposure, index, camera) | 1 : 0;
    return cameras_[camera].sensor.expose(cameras_[camera].lens.image(light, blur), key, rig_.noise_factor);
  };
  return {image(seen.left, 0, pair.left_blur_px), image(seen.right, 1, pair.right_blur_px)};
}

}  // namespace scanrig::sim
