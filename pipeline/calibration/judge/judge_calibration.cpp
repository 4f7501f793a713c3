#include "pipeline/calibration/judge/judge_calibration.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "pipeline/calibration/judge/rig_changes.h"
#include "pipeline/calibration/judge/sentences.h"
#include "pipeline/calibration/solve/volume_error.h"

namespace scanrig {
namespace {

constexpr double kMaxRatio = 1.5;
constexpr double kDifferenceToError = 3.0;  ///< A - B is a quarter to all of the error
constexpr double kMaxLinearPx = 2.0;        ///< a larger motion is beyond a linear test

/// A alone and B alone over the volume, against their covariances.
CrossValidation compare(const CalibrationInput& input, const CalibrationSolution& a, const CalibrationSolution& b) {
  const Calibration &from = a.solved.calibration, &to = b.solved.calibration;
  const std::vector<Eigen::Vector3d> grid = volume_grid(from);
  const VolumeParts parts(grid);
  const Eigen::VectorXd field = parts.without_scale_and_base(volume_difference(from, to, grid));
  CrossValidation found;
  found.difference = kMicrometresPerMm * rms_per_point(field);
  found.max = kMicrometresPerMm * max_per_point(field);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    found.shifts.push_back({grid[i], kMicrometresPerMm * field.segment<3>(3 * static_cast<Eigen::Index>(i))});
  }
  double variance = 0.0;
  for (const CalibrationSolution* part : {&a, &b}) {
    const Eigen::MatrixXd response = volume_response(input, part->start.unknowns, part->linear, grid);
    const double sigma = parts.sigma(part->normal.half_solve(response)).volume;
    variance += sigma * sigma;
  }
  found.expected = std::sqrt(variance);
  return found;
}

/// None: A or B alone is not enough to solve.
Result<std::optional<CrossValidation>> cross_validate(const CalibrationInput& input, const CalibrationSolution& whole,
                                                      const Context& context) {
  std::vector<bool> in_a, in_b;
  for (const BoardPair& pair : input.pairs) {
    in_a.push_back(pair.in_a);
    in_b.push_back(pair.in_b);
  }
  if (in_a == in_b) return std::optional<CrossValidation>{};
  const auto a = solve_part(whole, in_a, context);
  if (!a && a.error().code == ErrorCode::stopped) return pass_on(a);
  const auto b = solve_part(whole, in_b, context);
  if (!b && b.error().code == ErrorCode::stopped) return pass_on(b);
  if (!a || !b) return std::optional<CrossValidation>{};
  return std::optional(compare(input, *a, *b));
}

CalibrationGrade grade_of(double sigma) {
  if (sigma <= kGradeAUm) return CalibrationGrade::a;
  if (sigma <= kGradeBUm) return CalibrationGrade::b;
  return sigma <= kGradeCUm ? CalibrationGrade::c : CalibrationGrade::refused;
}

/// What points of the volume are off when a camera moved by so much after its images: micrometres.
double effect_of(const RigChange& change, const Calibration& calibration) {
  if (change.kind == RigChange::Kind::board) return 0.0;
  Calibration moved = calibration;
  const double turn = change.share * change.shift_px / calibration.right.projection.fx;
  moved.right.camera_from_turntable =
      small_motion({0.0, turn, 0.0}, Eigen::Vector3d::Zero()) * calibration.right.camera_from_turntable;
  const auto grid = volume_grid(calibration);
  return kMicrometresPerMm *
         rms_per_point(VolumeParts(grid).without_scale_and_base(volume_difference(calibration, moved, grid)));
}

void grade(const CalibrationInput& input, const SolvedCalibration& solved, CalibrationJudgement& out) {
  if (!solved.sigma) return;
  out.graded_um = solved.sigma->volume;
  const auto& ab = out.cross_validation;
  if (ab && ab->ratio() > kMaxRatio) out.graded_um = std::max(out.graded_um, kDifferenceToError * ab->difference);
  if (out.change) out.graded_um = std::max(out.graded_um, effect_of(*out.change, solved.calibration));
  out.grade = grade_of(out.graded_um);
  // Without a length, or without A against B, nothing proves it: C at best.
  if (!input.length || !ab) out.grade = std::max(out.grade, CalibrationGrade::c);
  if (is_to_be_refused(input, solved, out)) out.grade = CalibrationGrade::refused;
}

std::optional<RigChange> find_any_change(const CalibrationInput& input, const CalibrationSolution& whole) {
  if (whole.before_leaving_out) {
    const auto change = find_change(input, *whole.before_leaving_out);
    if (change && change->shift_px < kMaxLinearPx) return change;
    if (const auto motion = find_large_motion(whole.solved)) return motion;
  }
  return find_change(input, whole);
}

}  // namespace

std::string_view to_string(CalibrationGrade grade) {
  switch (grade) {
    case CalibrationGrade::a: return "A";
    case CalibrationGrade::b: return "B";
    case CalibrationGrade::c: return "C";
    case CalibrationGrade::refused: break;
  }
  return "refused";
}

Result<JudgedCalibration> judge_calibration(const CalibrationInput& input, const Context& context) {
  auto whole = solve_whole(input, context);
  if (!whole) return pass_on(whole);
  JudgedCalibration judged;
  if (whole->solved.sigma) {
    context.report("cross validation", 0.0);
    auto ab = cross_validate(input, *whole, context);
    if (!ab) return pass_on(ab);
    judged.judgement.cross_validation = *ab;
  }
  judged.judgement.change = find_any_change(input, *whole);
  judged.judgement.does_not_fit = whole->does_not_fit;
  grade(input, whole->solved, judged.judgement);
  judged.judgement.sentences = calibration_sentences(input, whole->solved, judged.judgement);
  judged.solved = std::move(whole->solved);
  context.report("cross validation", 1.0);
  return judged;
}

}  // namespace scanrig
