#pragma once

#include <optional>

#include "core/result.h"
#include "pipeline/calibration/solve/unknowns.h"

namespace scanrig {

/// Which images take part: [pair][camera].
using UsedImages = std::vector<std::array<bool, 2>>;

/// The linear start of the bundle: where cameras, axis and boards are, from each image alone.
struct StartingPoint {
  Unknowns unknowns;
  BundleSetup setup;
  std::vector<int> dot_ids;     ///< of Unknowns::dots
  bool is_height_known = true;  ///< a flat board or rim dots show the table top
};

/// Fails with `degenerate`: too few usable images, cameras that share no board, a table that does not turn.
Result<StartingPoint> find_start(const CalibrationInput& input, const UsedImages& used);

/// The sightings of the used images.
std::vector<Sighting> collect_sightings(const CalibrationInput& input, const UsedImages& used,
                                        const std::vector<int>& dot_ids);

/// Mean rotation and median shift; motions far from both are left out.
Transform middle_motion(const std::vector<Transform>& motions);

/// An axis of rotation in some frame.
struct TurnAxis {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  ///< the frame turns about it by gear * angle
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double gear = 1.0;  ///< > 0
};

/// A motion of the table between two reported angles.
struct TableTurn {
  Transform motion;  ///< frame of the cameras
  double angle_rad = 0.0;
};

/// Mean rotation vector, then least squares for the point. None: no turns, or turns that have no axis in common.
std::optional<TurnAxis> find_axis(const std::vector<TableTurn>& turns, const Eigen::Vector3d& near);

}  // namespace scanrig
