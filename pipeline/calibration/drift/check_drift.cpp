#include "pipeline/calibration/drift/check_drift.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "pipeline/calibration/solve/solution.h"
#include "pipeline/calibration/solve/volume_error.h"

namespace scanrig {
namespace {

constexpr double kHoldsUm = 10.0, kMovedUm = 30.0;
constexpr std::size_t kMinPairs = 4;
constexpr std::size_t kMinCorners = 12;
constexpr double kMaxNoisePx = 0.2;             ///< above it the board or a camera moved during the check
constexpr double kMiddleMm = 57.0;              ///< height of the volume's middle
constexpr double kCoarse = 1e-4, kFine = 1e-9;  ///< tolerances of the bundle

CalibrationInput input_of(const Calibration& known, const Board& board, const std::vector<BoardPair>& pairs) {
  CalibrationInput input;
  input.board = board;
  input.pairs = pairs;
  input.width = known.left.projection.width;
  input.height = known.left.projection.height;
  input.nominal_focal_px = known.left.projection.fx;
  input.serials = {known.left.serial, known.right.serial};
  input.table_radius_mm = known.table_radius_mm;
  return input;
}

UsedImages usable(const std::vector<BoardPair>& pairs) {
  UsedImages used;
  for (const BoardPair& pair : pairs) {
    const bool both = pair.left.corners.size() >= kMinCorners && pair.right.corners.size() >= kMinCorners;
    used.push_back({both, both});
  }
  return used;
}

/// Lenses and print as they are known.
void hold(const Calibration& known, const BoardPrint& print, StartingPoint& start) {
  Unknowns& u = start.unknowns;
  for (std::size_t c = 0; c < 2; ++c) {
    const Camera& camera = c == 0 ? known.left : known.right;
    u.cameras[c].lens = lens_block(camera);
    if (!camera.lens_field) continue;
    for (std::size_t i = 0; i < u.cameras[c].field.size(); ++i) {
      u.cameras[c].field[i] = {camera.lens_field->shift[i].x(), camera.lens_field->shift[i].y()};
    }
    start.setup.with_field = true;
  }
  u.shape = {print.scale - 1.0, print.aspect, print.shear, print.warp_mm[0], print.warp_mm[1], print.warp_mm[2]};
  u.offsets = print.offsets_mm;
  start.setup.holds_lens_and_board = true;
}

Result<void> settle(StartingPoint& start, const Context& context) {
  for (const double tolerance : {kCoarse, kFine}) {
    const auto steps = adjust(start.setup, start.unknowns, tolerance, context);
    if (!steps) return pass_on(steps);
    measure_noise(start.setup, start.unknowns);
  }
  if (start.setup.sigma_px < kMaxNoisePx) return {};
  return fail(ErrorCode::degenerate,
              "drift check: the corners fit to {:.2f} px only: the board or a camera moved; fix it, check again",
              start.setup.sigma_px);
}

/// `known` with the poses found; the height is that of the cameras' middle before.
Calibration with_poses(const Calibration& known, const Unknowns& u) {
  Calibration moved = known;
  moved.left.camera_from_turntable = to_transform(u.cameras[0].camera_from_table);
  moved.right.camera_from_turntable = to_transform(u.cameras[1].camera_from_table);
  const auto height = [](const Calibration& c) {
    return 0.5 * (c.left.camera_from_turntable.inverse().translation().y() +
                  c.right.camera_from_turntable.inverse().translation().y());
  };
  const Transform found_from_table(Eigen::Translation3d(0.0, height(moved) - height(known), 0.0));
  for (Camera* camera : {&moved.left, &moved.right}) {
    camera->camera_from_turntable = camera->camera_from_turntable * found_from_table;
  }
  return moved;
}

void describe_motion(const Calibration& known, DriftCheck& check) {
  const Transform &left = known.left.camera_from_turntable, &right = known.right.camera_from_turntable;
  const Transform &new_left = check.calibration.left.camera_from_turntable,
                  &new_right = check.calibration.right.camera_from_turntable;
  const Eigen::Vector3d middle(0.0, kMiddleMm, 0.0);
  const Transform right_from_left = new_right * new_left.inverse();
  const Transform as_if = right_from_left * left * right.inverse();
  Camera moved_right = known.right;
  moved_right.camera_from_turntable = as_if * right;
  check.cameras_px = moved_right.project(middle) - known.right.project(middle);
  const Transform known_from_new = left.inverse() * new_left;
  const Eigen::Vector3d shift = known_from_new * middle - middle;
  check.axis_mm = std::hypot(shift.x(), shift.z());
  const Eigen::Vector3d axis = known_from_new.linear().col(1);
  check.axis_deg = to_degrees(std::atan2(std::hypot(axis.x(), axis.z()), axis.y()));
}

DriftVerdict verdict_of(double difference_um) {
  if (difference_um < kHoldsUm) return DriftVerdict::holds;
  return difference_um <= kMovedUm ? DriftVerdict::moved : DriftVerdict::calibrate;
}

std::string sentence_of(const DriftCheck& check) {
  if (check.verdict == DriftVerdict::holds) {
    return fmt::format("The calibration holds: {:.0f} um off, {:.0f} expected of the check.", check.difference_um,
                       check.sigma_um);
  }
  const auto moved = fmt::format("Moved by {:.0f} um: cameras against each other {:.2f} px, axis {:.3f} mm.",
                                 check.difference_um, check.cameras_px.norm(), check.axis_mm);
  return moved + (check.verdict == DriftVerdict::moved ? " Accept the new poses." : " Calibrate the rig.");
}

}  // namespace

std::string_view to_string(DriftVerdict verdict) {
  switch (verdict) {
    case DriftVerdict::holds: return "holds";
    case DriftVerdict::moved: return "moved";
    case DriftVerdict::calibrate: break;
  }
  return "calibrate";
}

Result<DriftCheck> check_drift(const Calibration& known, const Board& board, const std::vector<BoardPair>& pairs,
                               const Context& context) {
  if (!known.quality || !known.quality->board ||
      known.quality->board->offsets_mm.size() != static_cast<std::size_t>(board.corner_count())) {
    return fail(ErrorCode::unsupported, "drift check: the calibration is not of this board; calibrate the rig");
  }
  const CalibrationInput input = input_of(known, board, pairs);
  const UsedImages used = usable(pairs);
  const auto count = static_cast<std::size_t>(std::ranges::count_if(used, [](const auto& pair) { return pair[0]; }));
  if (count < kMinPairs) {
    return fail(ErrorCode::degenerate, "drift check: {} images show the board to both cameras, {} are needed", count,
                kMinPairs);
  }
  auto start = find_start(input, used);
  if (!start) return pass_on(start);
  hold(known, *known.quality->board, *start);
  if (auto settled = settle(*start, context); !settled) return pass_on(settled);

  DriftCheck check;
  check.noise_px = start->setup.sigma_px;
  check.calibration = with_poses(known, start->unknowns);
  const auto grid = volume_grid(known);
  const VolumeParts parts(grid);
  check.difference_um = kMicrometresPerMm *
                        rms_per_point(parts.without_scale_and_base(volume_difference(known, check.calibration, grid)));
  const auto linear = linearise(start->setup, start->unknowns);
  if (!linear) return pass_on(linear);
  const auto normal = NormalMatrix::factorise(*linear);
  if (!normal) return pass_on(normal);
  check.sigma_um = parts.sigma(normal->half_solve(volume_response(input, start->unknowns, *linear, grid))).volume;
  describe_motion(known, check);
  check.verdict = verdict_of(check.difference_um);
  check.sentences = {sentence_of(check)};
  return check;
}

}  // namespace scanrig
