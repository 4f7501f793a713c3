#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"

namespace scanrig {

/// One sigma of what is known before anything is measured; docs/reference/calibration.md.
struct CalibrationPriors {
  double focal_share = 0.05;
  double focal_ratio = 1e-4;  ///< of fy / fx from 1
  double principal_px = 20.0;
  std::array<double, 5> distortion{0.3, 2.0, 2e-3, 2e-3, 2.0};  ///< k1 k2 p1 p2 k3
  double lens_field_px = 0.05;                                  ///< of each coefficient
  double angle_deg = 0.005;                                     ///< table angle, from the gear's straight line
  double gear_share = 0.05;                                     ///< of that line's slope from 1
  double table_tilt_deg = 0.001;                                ///< motion of the table's axis, per image
  double table_shift_mm = 0.003;                                ///< likewise
  double dot_height_mm = 0.02;                                  ///< rim dots, from their plane
  double thickness_mm = 0.02;                                   ///< of the board
};

/// A distance on the board: as ordered, and as measured with a certified instrument.
struct MeasuredLength {
  double nominal_mm = 0.0;
  double measured_mm = 0.0;
  double sigma_mm = 0.0;  ///< standard uncertainty of measured_mm
  /// Numbers of the inner corners that it joins: each is printed a hundredth of a millimetre from its place, and only
  /// the images know where. None: marks elsewhere on the board, as exact as the board as a whole.
  std::optional<std::array<int, 2>> corners{};
};
/// From the first to the last inner corner of the first row.
MeasuredLength first_row_length(const Board& board, double measured_mm, double sigma_mm);

/// What a calibration is solved from. Angles: CalibrationInput::pairs, counter-clockwise seen from above.
struct CalibrationInput {
  /// table: pairs of one placement share the board's place on the turning table.
  /// hand_held: every pair has its own place; the frame is the left camera's.
  enum class Form { table, hand_held };
  Form form = Form::table;
  int cameras = 2;  ///< 1: the left camera alone
  Board board;
  BoardKind board_kind = BoardKind::glass;
  std::vector<BoardPair> pairs;
  int width = 0;  ///< of every image, pixels
  int height = 0;
  double nominal_focal_px = 0.0;  ///< 5 % is near enough
  std::array<std::string, 2> serials;
  RimDots rim_dots;
  double table_radius_mm = 0.0;
  double gear_ratio = 0.0;                      ///< as configured, for messages; 0: unknown
  std::optional<MeasuredLength> length;         ///< fixes the scale; none: 3000 ppm
  std::optional<MeasuredLength> second_length;  ///< of another instrument, only compared
  CalibrationPriors priors;
  std::optional<bool> lens_field;  ///< none: by evidence
  std::string date;                ///< ISO 8601
};

/// The volume in which errors are propagated.
struct CalibrationVolume {
  double radius_mm = 55.0;
  double min_height_mm = 2.0;
  double max_height_mm = 112.0;
};

}  // namespace scanrig
