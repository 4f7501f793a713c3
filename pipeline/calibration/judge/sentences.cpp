#include "pipeline/calibration/judge/sentences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/calibration/solve/unknowns.h"

namespace scanrig {
namespace {

constexpr double kMaxGearError = 1e-3;   ///< refused above
constexpr double kSaidGearError = 1e-4;  ///< 0.02 degrees over half a turn
constexpr double kMaxTilt = 0.03;        ///< degrees of the axis from the table top's normal
constexpr double kMaxMove = 0.5;         ///< px
constexpr double kSigmas = 2.0;
constexpr double kFilled = 0.5;  ///< of an image's cells

bool are_swapped(const SolvedCalibration& solved) {
  if (solved.cameras < 2) return false;
  const Calibration& c = solved.calibration;
  const Transform left_from_right = c.left.camera_from_turntable * c.right.camera_from_turntable.inverse();
  return left_from_right.translation().x() < 0.0;
}

/// Share by which the second length contradicts the solution's scale; none: it agrees within two sigma.
std::optional<double> contradiction(const CalibrationInput& input, const SolvedCalibration& solved) {
  if (!input.second_length) return std::nullopt;
  const ScalePrior second = scale_prior(input.second_length);
  const double away =
      input.second_length->measured_mm / length_on_board(input.board, solved.board, *input.second_length) - 1.0;
  if (std::abs(away) <= kSigmas * std::hypot(second.sigma, solved.board.scale_sigma)) return std::nullopt;
  return away;
}

std::string_view side(int camera) { return camera == 0 ? "Left" : "Right"; }

void add_table(const CalibrationInput& input, const SolvedCalibration& solved, std::vector<std::string>& out) {
  if (input.form != CalibrationInput::Form::table) return;
  const SolvedTable& table = solved.table;
  if (table.gear < 0.0) out.emplace_back("Table turns the other way: change the sign of its direction.");
  const double gear = std::abs(table.gear);
  if (std::abs(gear - 1.0) > kSaidGearError) {
    out.push_back(input.gear_ratio > 0.0
                      ? fmt::format("Gear ratio {:.5g}, configured {:.5g}.", input.gear_ratio / gear, input.gear_ratio)
                      : fmt::format("Table turns {:.5f} of the reported angle: check the gear ratio.", gear));
  }
  if (table.axis_from_square_deg && *table.axis_from_square_deg > kMaxTilt) {
    out.push_back(fmt::format("Axis and table top {:.2f} deg from square.", *table.axis_from_square_deg));
  }
  if (!table.is_height_known) {
    out.emplace_back("Table top not seen: lay the board flat once, or print rim dots. Heights are not from the table.");
  }
}

void add_changes(const CalibrationJudgement& judgement, std::vector<std::string>& out) {
  if (!judgement.change) return;
  const RigChange& change = *judgement.change;
  if (change.kind == RigChange::Kind::board) {
    out.push_back(fmt::format("Board slipped in placement {}: fix it, show this placement again.", change.placement));
  } else if (change.kind == RigChange::Kind::focus) {
    out.push_back(fmt::format("Focus of the {} camera changed after placement {}: lock its rings, calibrate again.",
                              change.camera == 0 ? "left" : "right", change.placement));
  } else if (change.kind == RigChange::Kind::drift) {
    out.push_back(fmt::format("{} camera drifted by {:.2f} px: let the rig warm up for 30 minutes, calibrate again.",
                              side(change.camera), change.shift_px));
  } else {
    out.push_back(fmt::format("{} camera moved after placement {} ({:.2f} px): clamp it, calibrate again.",
                              side(change.camera), change.placement, change.shift_px));
  }
}

void add_images(const SolvedCalibration& solved, std::vector<std::string>& out) {
  for (const ImageFit& image : solved.images) {
    if (image.is_used || image.corners == 0) continue;
    std::string who = image.name;
    if (!who.empty() && who.front() >= 'a' && who.front() <= 'z')
      who.front() = static_cast<char>(who.front() - 'a' + 'A');
    if (image.left_out_because == "blurred") {
      out.push_back(fmt::format("{} {}, left out: focus or settling.", who, image.left_out_because));
    } else {
      out.push_back(
          fmt::format("{} ({}) left out: {}.", who, image.camera == 0 ? "left" : "right", image.left_out_because));
    }
  }
}

void add_lengths(const CalibrationInput& input, const SolvedCalibration& solved, std::vector<std::string>& out) {
  if (const auto away = contradiction(input, solved)) {
    out.push_back(fmt::format("Second length differs by {:.2f} %: measure both again.", 100.0 * std::abs(*away)));
  }
  if (!input.length) {
    out.push_back(fmt::format("No measured length: sizes uncertain by {:.1f} %.", 100.0 * scale_prior({}).sigma));
  }
}

/// What is missing where the boards show too little of the volume.
void add_coverage(const CalibrationInput& input, const SolvedCalibration& solved, std::vector<std::string>& out) {
  if (!solved.sigma || solved.sigma->volume <= kGradeAUm) return;
  const int cells = std::min(covered_cells(input, solved, 0), covered_cells(input, solved, 1));
  const double share = static_cast<double>(cells) / (kCoverageColumns * kCoverageRows);
  out.push_back(fmt::format("Points uncertain by {:.0f} um: ", solved.sigma->volume) +
                (share < kFilled ? fmt::format("boards filled only {:.0f} % of an image. Use a larger one, or show it "
                                               "nearer to the edges.",
                                               100.0 * share)
                                 : std::string("take more placements, and check focus and light.")));
}

}  // namespace

int covered_cells(const CalibrationInput& input, const SolvedCalibration& solved, int camera) {
  std::set<std::pair<int, int>> cells;
  for (const ImageFit& image : solved.images) {
    if (!image.is_used || image.camera != camera) continue;
    for (const CornerResidual& r : image.residuals) {
      cells.emplace(static_cast<int>(r.pixel.x() / input.width * kCoverageColumns),
                    static_cast<int>(r.pixel.y() / input.height * kCoverageRows));
    }
  }
  return static_cast<int>(cells.size());
}

bool is_to_be_refused(const CalibrationInput& input, const SolvedCalibration& solved,
                      const CalibrationJudgement& judgement) {
  const auto& change = judgement.change;
  const bool is_focus = change && change->kind == RigChange::Kind::focus;
  const bool moved = change && (change->shift_px > kMaxMove || is_focus);
  return judgement.does_not_fit || are_swapped(solved) || std::abs(solved.table.gear - 1.0) > kMaxGearError || moved ||
         contradiction(input, solved).has_value();
}

std::vector<std::string> calibration_sentences(const CalibrationInput& input, const SolvedCalibration& solved,
                                               const CalibrationJudgement& judgement) {
  std::vector<std::string> out;
  if (are_swapped(solved)) out.emplace_back("Left and right cameras swapped: exchange the serials.");
  add_table(input, solved, out);
  add_changes(judgement, out);
  if (judgement.does_not_fit) {
    out.emplace_back("More than a third of the images do not fit: check board layout and table angles.");
  }
  const auto& ab = judgement.cross_validation;
  if (ab && ab->ratio() > 1.5) {
    out.push_back(fmt::format("A and B differ by {:.0f} um, {:.0f} expected: lens model or board.", ab->difference,
                              ab->expected));
  }
  if (solved.sigma && !ab) out.emplace_back("A and B not compared: show boards for both. Grade C at best.");
  if (!solved.sigma) out.emplace_back("No volume to grade: needs two cameras and the table.");
  add_coverage(input, solved, out);
  add_lengths(input, solved, out);
  add_images(solved, out);
  return out;
}

}  // namespace scanrig
