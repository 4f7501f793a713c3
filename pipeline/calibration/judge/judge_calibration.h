#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/solve/calibration_input.h"
#include "pipeline/calibration/solve/solved_calibration.h"

namespace scanrig {

inline constexpr double kGradeAUm = 5.0, kGradeBUm = 15.0, kGradeCUm = 40.0;

/// By sigma over the volume, to these limits; else refused: not to be written.
enum class CalibrationGrade { a, b, c, refused };
std::string_view to_string(CalibrationGrade grade);  ///< "A", "B", "C", "refused"

/// What B alone makes of a point that A alone sees, micrometres.
struct PointShift {
  Eigen::Vector3d point;  ///< turntable frame, mm
  Eigen::Vector3d shift_um;
};

/// Calibration A alone against B alone, over the volume, micrometres; scale and base taken off.
struct CrossValidation {
  double difference = 0.0;  ///< rms
  double max = 0.0;
  double expected = 0.0;  ///< rms, from both covariances
  std::vector<PointShift> shifts;
  [[nodiscard]] double ratio() const { return expected > 0.0 ? difference / expected : 0.0; }
};

/// Something that changed while the boards were shown. Chi-square: what this change explains.
struct RigChange {
  /// camera: turned between two placements; focus: likewise, its focal length; drift: it turned all the time; board:
  /// slipped within a placement.
  enum class Kind { camera, focus, drift, board };
  Kind kind = Kind::camera;
  int camera = 0;         ///< but of a board: 0 left, 1 right
  int placement = 0;      ///< camera, focus: the last one before the change; board: the one in which it slipped
  double shift_px = 0.0;  ///< rms in the images after the change; drift: from the first image to the last
  double share = 1.0;     ///< of the camera's images from before the change
  double chi2 = 0.0;
};

struct CalibrationJudgement {
  CalibrationGrade grade = CalibrationGrade::refused;
  double graded_um = 0.0;                           ///< what the grade is by
  std::optional<CrossValidation> cross_validation;  ///< none: A or B has too few images
  std::optional<RigChange> change;
  bool does_not_fit = false;           ///< more than a third of the images do not fit
  std::vector<std::string> sentences;  ///< for the operator, most important first
};

struct JudgedCalibration {
  SolvedCalibration solved;
  CalibrationJudgement judgement;
};

/// Solves the whole, then A alone and B alone, and grades it. One camera and hand-held boards have no volume: their
/// grade is `refused`, with a sentence. Threads: any, one. Fails as solve_calibration(); a failure of A or B alone is
/// no failure.
Result<JudgedCalibration> judge_calibration(const CalibrationInput& input, const Context& context = {});

}  // namespace scanrig
