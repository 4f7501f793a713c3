#include "sim/scene/board_placement.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBlockHeight = 40.0;
constexpr double kAngleError = 10.0, kPlaceError = 15.0;  // of an operator: deg, mm

/// Turntable axes from the board's: it faces +z, leaning back, `tilt` (radians) from flat on its back.
Eigen::Matrix3d leaning(double tilt, bool portrait, bool left) {
  Eigen::Matrix3d r;
  r.col(0) = Vector3d::UnitX();
  r.col(1) = Vector3d(0.0, -std::sin(tilt), std::cos(tilt));
  r.col(2) = r.col(0).cross(r.col(1));
  return portrait ? Eigen::Matrix3d(r * AngleAxisd(left ? -M_PI_2 : M_PI_2, Vector3d::UnitZ())) : r;
}

/// A post behind a leaning board that ends just below its back. `foot`: in the frame of the lean, x and z.
Block post(const Vector2d& foot, double back_height, const Transform& table_from_lean) {
  constexpr double kHalf = 5.0;
  Block b;
  b.half = {kHalf, 0.5 * back_height, kHalf};
  b.table_from_block = table_from_lean * Eigen::Translation3d(foot.x(), 0.5 * back_height, foot.y());
  return b;
}

}  // namespace

const std::vector<PlannedPlacement>& calibration_plan() {
  static const std::vector<PlannedPlacement> plan = {
      {.number = 1, .tilt_deg = 60.0, .front_mm = 35.0, .mark_deg = 0.0},
      {.number = 2, .tilt_deg = 60.0, .front_mm = -30.0, .on_block = true, .mark_deg = 120.0},
      {.number = 3, .tilt_deg = 30.0, .front_mm = 0.0, .mark_deg = 240.0},
      {.number = 4,
       .in_a = false,
       .in_b = true,
       .portrait = true,
       .tilt_deg = 45.0,
       .front_mm = 30.0,
       .mark_deg = 60.0},
      {.number = 5,
       .in_a = false,
       .in_b = true,
       .portrait = true,
       .tilt_deg = 40.0,
       .front_mm = -10.0,
       .on_block = true,
       .mark_deg = 180.0},
      {.number = 6, .in_a = false, .in_b = true, .tilt_deg = 75.0, .front_mm = -35.0, .mark_deg = 300.0},
      {.number = 7, .in_b = true, .tilt_deg = 0.0, .front_mm = 0.0, .mark_deg = 0.0}};
  return plan;
}

std::vector<double> planned_angles(const PlannedPlacement& placement, int count) {
  constexpr double kHalfRange = 56.0;
  std::vector<double> angles;
  const bool flat = placement.tilt_deg == 0.0;
  const int views = flat ? count + 1 : count;
  for (int i = 0; i < views; ++i) {
    const double off = flat ? 360.0 * i / views : views == 1 ? 0.0 : kHalfRange * (2.0 * i / (views - 1.0) - 1.0);
    angles.push_back(std::remainder(off - placement.mark_deg, 360.0));
  }
  return angles;
}

PlacedBoard put_down(const PlannedPlacement& plan, const BoardLayout& board, double facing_rad, bool exactly,
                     std::uint64_t seed) {
  const auto even = [&](int n) { return exactly ? 0.5 : uniform(mix(seed, 0x706c, plan.number, n)); };
  const auto within = [&](double size, int n) { return size * (2.0 * even(n) - 1.0); };
  const bool flat = plan.tilt_deg == 0.0;
  const double tilt = to_radians(flat ? 0.0 : plan.tilt_deg + within(kAngleError, 0));
  const double azimuth = facing_rad + to_radians(within(kAngleError, 1));
  const double far = exactly ? 0.0 : kPlaceError * std::sqrt(even(2)), direction = 2.0 * M_PI * even(3);

  const double half_height = 0.5 * (plan.portrait ? board.width() : board.height());
  const double floor = plan.on_block ? kBlockHeight : 0.0;
  // The back of a leaning board is lower than its print, at its lower edge.
  const double up = floor + half_height * std::sin(tilt) + board.thickness_mm * std::cos(tilt);
  const Vector3d middle = rot_y(facing_rad) * Vector3d(0.0, up, plan.front_mm) +
                          far * Vector3d(std::sin(direction), 0.0, std::cos(direction));
  const Transform table_from_lean = Eigen::Translation3d(middle.x(), 0.0, middle.z()) * rot_y(azimuth);

  PlacedBoard placed;
  placed.table_from_board = table_from_lean * Eigen::Translation3d(0.0, up, 0.0);
  placed.table_from_board.linear() *= leaning(tilt, plan.portrait, even(4) < 0.5);
  if (flat) return placed;
  if (plan.on_block) {
    constexpr double kDepth = 18.0;
    const double edge = half_height * std::cos(tilt);  // of the lower edge, before the middle
    Block b;
    b.half = {30.0, 0.5 * kBlockHeight, kDepth};
    b.albedo = 0.42F;
    b.table_from_block = table_from_lean * Eigen::Translation3d(0.0, 0.5 * kBlockHeight, edge - kDepth + 4.0);
    placed.blocks.push_back(b);
  }
  // The back's height at the post's front side; it is under the upper third, or before the table's edge.
  const double behind = std::min(0.35 * half_height * std::cos(tilt) + 6.0, 70.0 + plan.front_mm);
  const double back = up + (behind - 5.0) * std::tan(tilt) - board.thickness_mm / std::cos(tilt);
  const double top = up + 0.8 * half_height * std::sin(tilt);
  const double height = std::min(back, top) - 0.3;
  placed.blocks.push_back(post({0.0, -behind}, height, table_from_lean));
  return placed;
}

PlacedBoard sunk(PlacedBoard placed, double mm) {
  placed.table_from_board.translation().y() -= mm;
  for (Block& block : placed.blocks) block.table_from_block.translation().y() -= mm;
  return placed;
}

PlacedBoard held_by_hand(std::uint64_t seed, int number) {
  const auto within = [&](double size, int n) { return size * (2.0 * uniform(mix(seed, 0x6868, number, n)) - 1.0); };
  const Vector3d middle(within(25.0, 0), 58.0 + within(18.0, 1), within(35.0, 2));
  Eigen::Matrix3d r = leaning(to_radians(65.0 + within(35.0, 3)), false, false);
  r = AngleAxisd(to_radians(within(35.0, 4)), Vector3d::UnitY()) * r *
      AngleAxisd(to_radians(within(25.0, 5)) + (number % 3 == 2 ? M_PI_2 : 0.0), Vector3d::UnitZ());
  PlacedBoard placed;
  placed.table_from_board = Eigen::Translation3d(middle) * Eigen::Quaterniond(r);
  return placed;
}

}  // namespace scanrig::sim
