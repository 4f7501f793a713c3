#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <random>

#include "pipeline/calibration/solve/calibration_input.h"
#include "pipeline/calibration/solve/solved_calibration.h"

namespace scanrig {

/// What is wrong with a synthetic rig; all zero: an ideal one. One sigma where random.
struct RigFaults {
  double noise_px = 0.02;
  double print_mm = 0.0;       ///< of each corner in the plane
  double warp_mm = 0.0;        ///< of the board, middle to edge
  double gear_deg = 0.0;       ///< amplitude of the table's periodic error
  double runout_mm = 0.0;      ///< motion of the axis, per image
  double lens_px = 0.0;        ///< rms of a smooth residual that Brown's coefficients do not have
  double board_scale = 1.0;    ///< of the real board over its certificate
  double moved_px = 0.0;       ///< turn of the right camera after half of the placements
  double focus = 0.0;          ///< share by which the right camera's focal length grows, likewise
  double drift_px = 0.0;       ///< turn of the right camera from the first image to the last
  int slipped_placement = -1;  ///< its board moves by 0.1 mm half-way
  double outlier_share = 0.0;  ///< corners that are 2 px off
  double axis_tilt_deg = 0.0;  ///< of the table top
  double gear = 1.0;           ///< turned over reported angle
  bool has_dots = false;
};

/// A stereo rig with a board, seen through a projection of its own; nothing is shared with the solver.
/// Table frame: +Y the axis, y = 0 the table top, the cameras' midpoint at x = 0, z > 0.
class SyntheticBoardRig {
 public:
  SyntheticBoardRig(const RigFaults& faults, unsigned seed);

  /// Seven placements, 50 pairs: the plan of three on A, three on B and one flat that serves both.
  [[nodiscard]] CalibrationInput observe(int angles_per_placement = 7);
  /// The true pixel of a point, in the camera as it was at first.
  [[nodiscard]] Eigen::Vector2d pixel(int camera, const Eigen::Vector3d& point_in_table) const;
  [[nodiscard]] bool is_seen(const Eigen::Vector3d& point_in_table) const;  ///< by both cameras
  /// Places a board as boards are held by hand, before both cameras.
  [[nodiscard]] CalibrationInput observe_hand_held(int pairs);

  /// Rms and greatest volume error, micrometres; scale and height over the table taken off.
  struct VolumeError {
    double rms = 0.0, max = 0.0, scale_ppm = 0.0, height = 0.0;
  };
  [[nodiscard]] VolumeError error_of(const Calibration& calibration) const;
  [[nodiscard]] const RigFaults& faults() const { return faults_; }
  /// right_from_left
  [[nodiscard]] Eigen::Isometry3d stereo() const { return pose_[1] * pose_[0].inverse(); }
  /// Between two corners as printed, mm.
  [[nodiscard]] double printed_mm(std::size_t from, std::size_t to) const { return (print_[to] - print_[from]).norm(); }
  [[nodiscard]] double focal(int camera) const { return focal_[camera]; }

 private:
  struct Look {
    bool has_moved = false;
    double progress = 0.0;  ///< of all placements, 0 to 1
    double angle = 0.0;
    Eigen::Isometry3d wobble = Eigen::Isometry3d::Identity();
  };
  [[nodiscard]] Eigen::Vector2d through_lens(int camera, const Eigen::Vector3d& in_camera) const;
  BoardSight see(int camera, const Eigen::Isometry3d& table_from_board, const Look& look);
  void add_placement(CalibrationInput& input, int number, const Eigen::Isometry3d& facing, double mark_deg, bool in_a,
                     bool in_b, const std::vector<double>& angles_deg);
  double normal(double sigma) { return sigma > 0.0 ? sigma * unit_(random_) : 0.0; }

  RigFaults faults_;
  std::mt19937 random_;
  std::normal_distribution<double> unit_{0.0, 1.0};
  double focal_[2], centre_[2][2], brown_[2][5], phase_[2][4];
  Eigen::Isometry3d pose_[2];  ///< camera_from_table
  std::vector<Eigen::Vector3d> print_;
  CalibrationInput blank_;
};

}  // namespace scanrig
