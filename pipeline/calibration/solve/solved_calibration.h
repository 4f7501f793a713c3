#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/calibration/board_print.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/solve/calibration_input.h"

namespace scanrig {

/// Sigma of a triangulated point over the working volume by part, micrometres, rms over the grid. Turntable frame.
struct VolumeSigma {
  double axis = 0.0;     ///< place and direction of the table's axis
  double strain = 0.0;   ///< shape
  double azimuth = 0.0;  ///< turn about the axis
  double scale = 0.0;    ///< of all lengths alike; from the measured length
  double base = 0.0;     ///< height over the table top
  double volume = 0.0;   ///< axis, strain and azimuth
  double max = 0.0;      ///< the greatest of the grid, likewise without scale and base
};

/// The same at one point of the volume.
struct PointSigma {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< mm
  double axis = 0.0, strain = 0.0, azimuth = 0.0, scale = 0.0, base = 0.0, volume = 0.0;
};

/// What the solution leaves of one corner of one image.
struct CornerResidual {
  int id = 0;             ///< as in Board::corner()
  Eigen::Vector2d pixel;  ///< as measured
  Eigen::Vector2d miss;   ///< pixel minus model
};

/// How one image fits the solution.
struct ImageFit {
  std::string name;  ///< of its pair
  int placement = 0;
  int camera = 0;  ///< 0 left, 1 right
  int corners = 0;
  bool is_used = false;
  std::string left_out_because;                       ///< empty when used
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< pixel minus model
  double rms_px = 0.0;
  double median_px = 0.0;                 ///< of the residuals' lengths
  double blur_px = 0.0;                   ///< median over the corners
  std::vector<CornerResidual> residuals;  ///< of each corner, ascending id; also of an image that is left out
};

/// Mean residual of all images of one placement and camera; sees what the rms cannot.
struct PlacementFit {
  int placement = 0;
  int camera = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
};

/// The print, and how well its scale is known.
struct SolvedBoard : BoardPrint {
  double scale_sigma = 0.0;
};

/// A length on the board as solved, mm.
double length_on_board(const Board& board, const SolvedBoard& solved, const MeasuredLength& length);

struct SolvedTable {
  double gear = 1.0;                           ///< turned angle over reported angle; < 0: turns the other way
  std::vector<double> angle_error_deg;         ///< per pair: turned minus gear times reported
  std::vector<Eigen::Vector3d> dots;           ///< rim dots at table angle 0, mm
  std::vector<int> dot_ids;                    ///< as DotObservation::id
  std::optional<double> axis_from_square_deg;  ///< of the axis from the table top's normal; none: top not seen
  bool is_height_known = true;                 ///< y = 0 is the table top; else a board's middle
};

/// A solved calibration and what is known of it. Hand-held form: the turntable frame is the left camera's.
struct SolvedCalibration {
  Calibration calibration;  ///< with one camera `right` is empty
  int cameras = 2;
  bool has_lens_field = false;
  double field_evidence = 0.0;  ///< chi-square that the lens field takes off, per coefficient
  double noise_px = 0.0;        ///< sigma of a corner's coordinate
  double median_px = 0.0;       ///< median length of the residuals of used images
  std::vector<ImageFit> images;
  std::vector<PlacementFit> placements;
  std::vector<Transform> turntable_from_board;  ///< per pair, as the table had turned it then
  SolvedBoard board;
  SolvedTable table;
  std::optional<VolumeSigma> sigma;  ///< none: one camera, or no table
  std::vector<PointSigma> sigma_at;  ///< of each point of the grid that `sigma` is over
  /// Covariance of the cameras' unknowns: per camera fx, fy / fx, cx, cy, k1 k2 p1 p2 k3 (9), pose (turn and shift of
  /// the table in the camera frame, rad and mm; 6), lens field (du, dv; 84 if it has one).
  Eigen::MatrixXd camera_covariance;
  int steps = 0;  ///< of the bundle, all rounds
};

}  // namespace scanrig
