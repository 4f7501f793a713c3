#include "sim/scene/rig_variation.h"

#include <cmath>
#include <string_view>
#include <utility>

#include "core/units.h"
#include "sim/scene/lens_residual.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Random numbers by purpose.
class Draw {
 public:
  Draw(std::uint64_t seed, std::uint64_t purpose) : seed_(mix(seed, 0x7269, purpose)) {}
  /// Within +-`size`, even.
  double within(double size) { return size * (2.0 * uniform(mix(seed_, ++number_)) - 1.0); }
  double between(double low, double high) { return low + (high - low) * uniform(mix(seed_, ++number_)); }
  double gauss(double sigma) { return sigma * normal(mix(seed_, ++number_)); }
  Vector3d box(double size) {
    const double x = within(size), y = within(size), z = within(size);
    return {x, y, z};
  }

 private:
  std::uint64_t seed_;
  std::uint64_t number_ = 0;
};

enum Purpose : std::uint8_t {
  left_lens,
  right_lens,
  mounting,
  axis,
  left_aim,
  right_aim,
  table,
  dots,
  noise,
  residual
};

void draw_lens(Eye& eye, double share, double scale, Draw draw) {
  eye.fx *= 1.0 + draw.within(0.03 * share);
  eye.fy = eye.fx * (1.0 + draw.within(5e-5 * share));
  eye.cx += draw.within(12.0 * share) * scale;
  eye.cy += draw.within(12.0 * share) * scale;
  const std::array<double, 5> spread = {0.04, 0.1, 2e-4, 2e-4, 0.1};
  for (std::size_t i = 0; i < spread.size(); ++i) eye.distortion[i] += draw.within(spread[i] * share);
}

/// Rotation of the eye about its own axes, applied after its pose: radians.
Transform turned(const Vector3d& rotation_vector, const Transform& eye_from_turntable) {
  return small_motion(rotation_vector, Vector3d::Zero()) * eye_from_turntable;
}

/// Poses in the frame of the nominal axis.
void mount(RigGeometry& rig, const RigVariation& v) {
  const Profile& p = profile();
  Draw draw(v.seed, mounting);
  const double elevation = to_radians(p.elevation_deg + v.mounting * (draw.between(15.0, 30.0) - p.elevation_deg));
  const double baseline = p.baseline_mm + v.mounting * (draw.between(120.0, 200.0) - p.baseline_mm);
  const double distance = p.distance_mm + draw.within(15.0 * v.mounting);
  const Vector3d aim(0.0, p.aim_height_mm, 0.0), half(0.5 * baseline, 0.0, 0.0);
  const Vector3d middle = aim + distance * Vector3d(0.0, std::sin(elevation), std::cos(elevation));
  const auto place = [&](Eye& eye, const Vector3d& centre, Draw own) {
    eye.eye_from_turntable = looking_at(centre, aim + own.box(3.0 * v.axis));
    eye.eye_from_turntable = turned({0.0, 0.0, to_radians(own.within(0.5 * v.axis))}, eye.eye_from_turntable);
  };
  place(rig.left, middle - half, Draw(v.seed, left_aim));
  place(rig.right, middle + half, Draw(v.seed, right_aim));
  rig.projector.eye_from_turntable = looking_at(middle + Vector3d(0.0, p.projector_above_mm, 0.0), aim);
}

/// From the frame of the nominal axis to that of the drawn one, azimuth included.
void refer_to_axis(RigGeometry& rig, const RigVariation& v) {
  Draw draw(v.seed, axis);
  const Vector3d tilt(to_radians(draw.within(0.5 * v.axis)), 0.0, to_radians(draw.within(0.5 * v.axis)));
  const Vector3d shift = draw.box(1.5 * v.axis);
  const Transform nominal_from_axis = small_motion(tilt, shift);
  const Vector3d middle = nominal_from_axis.inverse() * (0.5 * (rig.left.centre() + rig.right.centre()));
  const Transform nominal_from_turntable = nominal_from_axis * rot_y(std::atan2(middle.x(), middle.z()));
  for (Eye* eye : {&rig.left, &rig.right, &rig.projector}) {
    eye->eye_from_turntable = eye->eye_from_turntable * nominal_from_turntable;
  }
}

TableErrors draw_table(const RigVariation& v) {
  Draw draw(v.seed, table);
  TableErrors t;
  t.reversed = v.reversed != 0.0;
  t.gear_factor = 1.0 + draw.gauss(v.gear);
  t.amplitude_deg = {v.angle_deg, v.angle_deg / 3.0};
  t.phase_rad = {draw.within(std::numbers::pi), draw.within(std::numbers::pi)};
  t.runout_mm = v.runout_mm;
  t.seed = mix(v.seed, 0x72756e);
  const double x = to_radians(draw.gauss(v.top_tilt_deg)), z = to_radians(draw.gauss(v.top_tilt_deg));
  t.axis_from_top = small_motion({x, 0.0, z}, Vector3d::Zero());
  return t;
}

}  // namespace

bool TableErrors::is_ideal() const {
  const bool turns_true = axis.runout_mm == 0.0 && axis.wobble_rad == 0.0 && axis.worm_deg == 0.0;
  return !is_drawn && turns_true && axis_from_top.matrix() == Transform::Identity().matrix();
}

Transform AxisErrors::motion(double true_rad) const {
  if (runout_mm == 0.0 && wobble_rad == 0.0) return Transform::Identity();
  // Phases in turns, drawn once: a first harmonic alike in both axes would only move the axis.
  const auto harmonics = [true_rad](double first, double second) {
    return 0.8 * std::cos(true_rad + 2.0 * std::numbers::pi * first) +
           0.6 * std::cos(2.0 * true_rad + 2.0 * std::numbers::pi * second);
  };
  const Vector3d shift(runout_mm * harmonics(0.13, 0.71), 0.0, runout_mm * harmonics(0.06, 0.38));
  const Vector3d turn(wobble_rad * harmonics(0.55, 0.92), 0.0, wobble_rad * harmonics(0.47, 0.24));
  return small_motion(turn, shift);
}

double TableErrors::true_deg(double reported_deg) const {
  const double at = to_radians(reported_deg);
  const double forward = gear_factor * reported_deg + amplitude_deg[0] * std::sin(at + phase_rad[0]) +
                         amplitude_deg[1] * std::sin(2.0 * at + phase_rad[1]);
  const double by_worm =
      axis.worm_deg == 0.0
          ? 0.0
          : axis.worm_deg * std::sin(2.0 * std::numbers::pi * reported_deg / AxisErrors::kWormTurnDeg + 1.0);
  return reversed ? -(forward + by_worm) : forward + by_worm;
}

Transform TableErrors::motion(double true_deg) const {
  if (runout_mm == 0.0) return axis.motion(to_radians(true_deg));
  constexpr double kLever = 60.0;  // mm
  const auto place = (std::llround(100.0 * true_deg) % 36000 + 36000) % 36000;
  std::array<double, 5> sizes{};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto phase = [&](int n) { return 2.0 * std::numbers::pi * uniform(mix(seed, i, n)); };
    const double at = to_radians(true_deg);
    sizes[i] = runout_mm * (1.1 * std::cos(at + phase(1)) + 0.7 * std::cos(2.0 * at + phase(2)) +
                            0.4 * normal(mix(seed, i, 3, place)));
  }
  return axis.motion(to_radians(true_deg)) *
         small_motion(Vector3d(sizes[3], 0.0, sizes[4]) / kLever, {sizes[0], sizes[1], sizes[2]});
}

Transform TableErrors::turntable_from_ideal(double true_rad) const {
  return motion(to_degrees(true_rad)) * rot_y(true_rad) * axis_from_top * rot_y(-true_rad);
}

DrawnRig draw_rig(const RigVariation& v, double image_scale) {
  constexpr double kCornerSigma = 0.009;  // px, of a corner found at the profile's noise
  DrawnRig rig{.geometry = default_rig(image_scale)};
  mount(rig.geometry, v);
  draw_lens(rig.geometry.left, v.lenses, image_scale, Draw(v.seed, left_lens));
  draw_lens(rig.geometry.right, v.lenses, image_scale, Draw(v.seed, right_lens));
  refer_to_axis(rig.geometry, v);
  if (v.residual_px > 0.0) {
    for (Eye* eye : {&rig.geometry.left, &rig.geometry.right}) {
      const std::uint64_t seed = mix(v.seed, residual, eye == &rig.geometry.left);
      eye->residual = draw_lens_residual(*eye, v.residual_px * image_scale, seed);
    }
  }
  if (v.swapped != 0.0) {
    std::swap(rig.geometry.left, rig.geometry.right);
    std::swap(rig.geometry.left.serial, rig.geometry.right.serial);
  }
  rig.table = draw_table(v);
  Draw print(v.seed, dots);
  for (auto& dot : rig.rim_dots) {
    dot.x() = print.gauss(v.rim_dots_mm);
    dot.y() = print.gauss(v.rim_dots_mm);
  }
  if (v.noise > 0.0) rig.noise_factor = v.noise * Draw(v.seed, noise).between(0.02, 0.05) / kCornerSigma;
  return rig;
}

RigGeometry against_table_motion(const RigGeometry& rig, const TableErrors& table, double true_rad) {
  const Transform turntable_from_ideal = table.turntable_from_ideal(true_rad);
  RigGeometry moved = rig;
  for (Eye* eye : {&moved.left, &moved.right, &moved.projector}) {
    eye->eye_from_turntable = eye->eye_from_turntable * turntable_from_ideal;
  }
  return moved;
}

}  // namespace scanrig::sim
