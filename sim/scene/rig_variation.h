#pragma once

#include <array>
#include <cstdint>

#include "core/transform.h"
#include "sim/scene/named_values.h"
#include "sim/scene/optics.h"
#include "sim/scene/table_top.h"

namespace scanrig::sim {

/// How far a drawn rig may be from the default one. Each number is a size; 0 switches it off. The draws are functions
/// of the seed and of what is drawn: switching one off leaves the others as they are.
struct RigVariation {
  std::uint64_t seed = 1;
  double lenses = 1.0;  ///< share of: focal +-3 %, fy/fx +-5e-5, centre +-12 px, k1 +-0.04, k2 and k3 +-0.1, p +-2e-4
  double residual_px =
      0.03;               ///< rms of the lens residual, full sensor; Brown's model and a turned camera know none of it
  double mounting = 1.0;  ///< share of: baseline 120 to 200, distance +-15 mm, elevation 15 to 30 deg
  double axis = 1.0;      ///< share of: axis +-0.5 deg and +-1.5 mm off nominal, cameras aim +-3 mm, roll +-0.5 deg
  double runout_mm = 0.002;    ///< the axis's runout, about the rms in each direction; wobble: that much at 60 mm
  double top_tilt_deg = 0.02;  ///< sigma of the table top, from square to the axis, each way
  double gear = 2e-4;          ///< sigma of the gear factor
  double angle_deg = 0.01;     ///< amplitude of the angle's error of one turn; half a turn: a third of it
  double rim_dots_mm = 0.03;   ///< sigma of the print, each way
  double noise = 0.0;          ///< 1: sensor noise so that a corner is found to 0.02 to 0.05 px, as drawn
  double swapped = 0.0;        ///< 1: left and right cameras exchanged
  double reversed = 0.0;       ///< 1: the table turns the other way than it reports
};

inline constexpr std::array<NamedValue<RigVariation>, 12> kRigVariationNames = {{
    {"lenses", &RigVariation::lenses},
    {"residual", &RigVariation::residual_px},
    {"mounting", &RigVariation::mounting},
    {"axis", &RigVariation::axis},
    {"runout", &RigVariation::runout_mm},
    {"top-tilt", &RigVariation::top_tilt_deg},
    {"gear", &RigVariation::gear},
    {"angle", &RigVariation::angle_deg},
    {"rim-dots", &RigVariation::rim_dots_mm},
    {"noise", &RigVariation::noise},
    {"swapped", &RigVariation::swapped},
    {"reversed", &RigVariation::reversed},
}};

/// Mechanics of profile 2's turntable.
struct AxisErrors {
  double runout_mm = 0.0;   ///< radial: each way, first and second harmonic together
  double wobble_rad = 0.0;  ///< likewise, about both horizontal axes
  double worm_deg = 0.0;    ///< amplitude of the angle's error, over one turn of the worm

  static constexpr double kWormTurnDeg = 4.0;

  /// Runout and wobble at the true angle (radians): applied after the turn.
  [[nodiscard]] Transform motion(double true_rad) const;
};

/// The table of one rig: where it really is when it reports an angle.
struct TableErrors {
  bool is_drawn = false;  ///< by a RigVariation
  bool reversed = false;
  double gear_factor = 1.0;               ///< true turn per reported turn
  std::array<double, 2> amplitude_deg{};  ///< of the periodic error of the angle, one and two periods a turn
  std::array<double, 2> phase_rad{};
  double runout_mm = 0.0;
  std::uint64_t seed = 0;                           ///< of the runout's shape
  Transform axis_from_top = Transform::Identity();  ///< the top's tilt; turns with the table
  AxisErrors axis{};                                ///< of profile 2, beside those

  /// Angle about the axis, counter-clockwise seen from above, when the table reports `reported_deg`.
  [[nodiscard]] double true_deg(double reported_deg) const;
  /// What the table does beside turning, at the true angle: applied after the turn. Same angle, same motion.
  [[nodiscard]] Transform motion(double true_deg) const;
  /// Whether the table is where it reports to be: profile 1.
  [[nodiscard]] bool is_ideal() const;
  /// Turntable frame from a frame in which the table top turns without any error at the true angle (radians).
  [[nodiscard]] Transform turntable_from_ideal(double true_rad) const;
};

struct DrawnRig {
  RigGeometry geometry;
  TableErrors table{};
  RimDotErrors rim_dots = kRimDotsAsDesigned;
  double noise_factor = 1.0;  ///< of the sensors' noise
};

/// The default rig, with sensors of `image_scale` times the full resolution, changed as the seed says. The turntable
/// frame is that of the drawn axis: +Y the axis, y = 0 where it meets the table top, the middle between the cameras at
/// x = 0, z > 0. Same arguments, same bits.
DrawnRig draw_rig(const RigVariation& variation, double image_scale);

/// The eyes as they see a table without errors: what they are in truth at that true angle (radians), moved against the
/// table's motion.
RigGeometry against_table_motion(const RigGeometry& rig, const TableErrors& table, double true_rad);

}  // namespace scanrig::sim
