#include "pipeline/calibration/solve/solve_calibration.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include "pipeline/calibration/solve/focal_length.h"
#include "tests/unit/pipeline/calibration/synthetic_board_rig.h"

namespace scanrig {
namespace {

RigFaults all_faults() {
  RigFaults faults;
  faults.print_mm = 0.008;
  faults.warp_mm = 0.1;
  faults.gear_deg = 0.01;
  faults.runout_mm = 0.002;
  faults.lens_px = 0.03;
  return faults;
}

double seconds_of_this_program() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

TEST(SolveCalibration, AllFaultsTogetherCostFewMicrometres) {
  SyntheticBoardRig rig(all_faults(), 100);
  const double before = seconds_of_this_program();
  const auto solved = solve_calibration(rig.observe());
  const double seconds = seconds_of_this_program() - before;
  ASSERT_TRUE(solved) << solved.error().message;
  const auto error = rig.error_of(solved->calibration);
  EXPECT_LT(error.rms, 4.0);
  EXPECT_LT(error.max, 11.0);
  EXPECT_LT(std::abs(error.scale_ppm), 100.0);
  EXPECT_LT(std::abs(error.height), 40.0);
  EXPECT_TRUE(solved->has_lens_field);
  // The corners' print error is 0.05 px: solved for, it is no noise.
  EXPECT_LT(solved->noise_px, 0.022);
  RecordProperty("seconds", std::to_string(seconds));
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const bool is_emulated = std::getenv("SCANRIG_EMULATED") != nullptr;
  EXPECT_TRUE(is_emulated || seconds < 15.0) << seconds;
  EXPECT_LT(usage.ru_maxrss, 1024 * 1024);
#endif
}

TEST(SolveCalibration, NeedsNoFocalLengthFromAnyone) {
  SyntheticBoardRig rig(all_faults(), 3);
  const auto input = rig.observe();
  const auto found = find_focal_px(input.board, input.pairs, input.width, input.height);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found / rig.focal(0), 1.0, 0.03);
  EXPECT_FALSE(find_focal_px(input.board, {}, input.width, input.height));
}

/// A corner of the print as solved, board frame.
Eigen::Vector3d printed(const Board& order, const SolvedBoard& board, int id) {
  const Eigen::Vector3d at = order.corner(id), edge = order.corner(order.corner_count() - 1);
  const double x = at.x(), y = at.y(), u = x / edge.x(), v = y / edge.y();
  const auto& offset = board.offsets_mm[static_cast<std::size_t>(id)];
  return {board.scale * (x + 0.5 * (board.aspect * x + board.shear * y)) + offset[0],
          board.scale * (y + 0.5 * (board.shear * x - board.aspect * y)) + offset[1],
          board.warp_mm[0] * u * u + board.warp_mm[1] * u * v + board.warp_mm[2] * v * v + offset[2]};
}

TEST(SolveCalibration, KeepsEachResidualAndWhereEachBoardStood) {
  SyntheticBoardRig rig(all_faults(), 115);
  CalibrationInput input = rig.observe(3);
  input.pairs[1].left.corners[5].pixel.x() += 4.0;
  const auto solved = solve_calibration(input);
  ASSERT_TRUE(solved) << solved.error().message;
  ASSERT_EQ(solved->turntable_from_board.size(), input.pairs.size());
  for (std::size_t k = 0; k < input.pairs.size(); ++k) {
    for (std::size_t c = 0; c < 2; ++c) {
      const ImageFit& image = solved->images[2 * k + c];
      const auto& corners = (c == 0 ? input.pairs[k].left : input.pairs[k].right).corners;
      const Camera& camera = c == 0 ? solved->calibration.left : solved->calibration.right;
      ASSERT_EQ(image.residuals.size(), corners.size());
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const CornerResidual& r = image.residuals[i];
        ASSERT_EQ(r.id, corners[i].id);
        ASSERT_EQ(r.pixel, corners[i].pixel);
        const Eigen::Vector3d point = solved->turntable_from_board[k] * printed(input.board, solved->board, r.id);
        // The solver has the lens field at the measured pixel, the camera at the modelled one.
        ASSERT_LT((r.pixel - camera.project(point) - r.miss).norm(), 0.01) << k << " " << c << " " << r.id;
      }
    }
  }
  EXPECT_NEAR(solved->images[2].residuals[5].miss.x(), 4.0, 0.2);
}

TEST(SolveCalibration, SigmaOfTheVolumeIsTheRmsOverItsPoints) {
  SyntheticBoardRig rig({}, 116);
  const auto solved = solve_calibration(rig.observe(3));
  ASSERT_TRUE(solved) << solved.error().message;
  ASSERT_GT(solved->sigma_at.size(), 100u);
  double volume = 0.0, axis = 0.0, base = 0.0, greatest = 0.0;
  for (const PointSigma& p : solved->sigma_at) {
    volume += p.volume * p.volume;
    axis += p.axis * p.axis;
    base += p.base * p.base;
    greatest = std::max(greatest, p.volume);
    EXPECT_LE(std::hypot(p.point.x(), p.point.z()), 55.0 + 1e-9);
  }
  const auto count = static_cast<double>(solved->sigma_at.size());
  EXPECT_NEAR(std::sqrt(volume / count), solved->sigma->volume, 1e-9);
  EXPECT_NEAR(std::sqrt(axis / count), solved->sigma->axis, 1e-9);
  EXPECT_NEAR(std::sqrt(base / count), solved->sigma->base, 1e-9);
  EXPECT_NEAR(greatest, solved->sigma->max, 1e-9);
}

TEST(SolveCalibration, PredictsItsError) {
  double actual = 0.0, predicted = 0.0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SyntheticBoardRig rig(all_faults(), seed);
    const auto solved = solve_calibration(rig.observe());
    ASSERT_TRUE(solved) << solved.error().message;
    const auto error = rig.error_of(solved->calibration);
    actual += error.rms * error.rms;
    predicted += solved->sigma->volume * solved->sigma->volume;
    EXPECT_LT(error.rms, 4.0) << seed;
  }
  RecordProperty("ratio", std::to_string(std::sqrt(actual / predicted)));
  EXPECT_GT(std::sqrt(actual / predicted), 0.8);
  EXPECT_LT(std::sqrt(actual / predicted), 1.3);
}

TEST(SolveCalibration, AnIdealRigNeedsNoLensField) {
  SyntheticBoardRig rig({}, 7);
  const auto solved = solve_calibration(rig.observe());
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_FALSE(solved->has_lens_field);
  EXPECT_LT(rig.error_of(solved->calibration).rms, 1.5);
  EXPECT_NEAR(solved->noise_px, 0.02, 0.001);
}

TEST(SolveCalibration, ANominalFocalLengthThreePerCentOffGivesTheSame) {
  SyntheticBoardRig rig({}, 8);
  CalibrationInput input = rig.observe();
  const auto near = solve_calibration(input);
  input.nominal_focal_px *= 1.03;
  const auto off = solve_calibration(input);
  ASSERT_TRUE(near && off);
  const auto a = rig.error_of(near->calibration), b = rig.error_of(off->calibration);
  EXPECT_NEAR(a.rms, b.rms, 0.05);
  EXPECT_NEAR(near->calibration.left.projection.fx, off->calibration.left.projection.fx, 0.05);
}

TEST(SolveCalibration, SameInputSameBits) {
  SyntheticBoardRig rig(all_faults(), 9);
  const CalibrationInput input = rig.observe();
  const auto a = solve_calibration(input), b = solve_calibration(input);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->calibration.left.projection.fx, b->calibration.left.projection.fx);
  EXPECT_EQ(a->calibration.right.camera_from_turntable.matrix(), b->calibration.right.camera_from_turntable.matrix());
  EXPECT_EQ(a->camera_covariance, b->camera_covariance);
  EXPECT_EQ(a->sigma->volume, b->sigma->volume);
}

TEST(SolveCalibration, OutliersAndABadImageDoNotMatter) {
  RigFaults faults = all_faults();
  faults.outlier_share = 0.01;
  SyntheticBoardRig rig(faults, 10);
  CalibrationInput input = rig.observe();
  for (auto& corner : input.pairs[11].right.corners) corner.pixel += Eigen::Vector2d(0.4, 0.3);
  for (auto& corner : input.pairs[24].left.corners) corner.blur_px = 1.9;
  const auto solved = solve_calibration(input);
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_LT(rig.error_of(solved->calibration).rms, 4.0);
  std::vector<std::string> out;
  for (const ImageFit& image : solved->images) {
    if (!image.is_used) out.push_back(image.name + (image.camera == 0 ? " left " : " right ") + image.left_out_because);
  }
  ASSERT_EQ(out.size(), 2U) << ::testing::PrintToString(out);
  EXPECT_EQ(out[0].substr(0, 37), "placement 2 image 5 right does not fi");
  EXPECT_EQ(out[1], "placement 4 image 4 left blurred");
}

TEST(SolveCalibration, RimDotsShowTheTableTop) {
  RigFaults faults;
  faults.has_dots = true;
  SyntheticBoardRig rig(faults, 11);
  CalibrationInput input = rig.observe();
  input.board.thickness_mm = 3.4;  // wrong, and not needed
  const auto solved = solve_calibration(input);
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_LT(solved->sigma->base, 6.0);
  EXPECT_LT(std::abs(rig.error_of(solved->calibration).height), 15.0);
  EXPECT_GT(solved->table.dots.size(), 20U);
}

TEST(SolveCalibration, TheMeasuredLengthSetsTheScale) {
  RigFaults faults;
  faults.board_scale = 1.003;
  SyntheticBoardRig rig(faults, 12);
  CalibrationInput input = rig.observe();
  input.length = MeasuredLength{100.0, 100.3, 0.01};
  const auto solved = solve_calibration(input);
  ASSERT_TRUE(solved);
  EXPECT_LT(std::abs(rig.error_of(solved->calibration).scale_ppm), 50.0);
  EXPECT_NEAR(solved->board.scale_sigma, 1e-4, 1e-5);
  input.length.reset();
  const auto unknown = solve_calibration(input);
  ASSERT_TRUE(unknown);
  EXPECT_NEAR(unknown->board.scale_sigma, 3e-3, 1e-4);
}

TEST(SolveCalibration, ALengthBetweenCornersCountsFromWhereTheyArePrinted) {
  RigFaults faults;
  faults.print_mm = 0.01;
  for (const unsigned seed : {21U, 22U, 23U}) {
    SyntheticBoardRig rig(faults, seed);
    CalibrationInput input = rig.observe(3);
    input.length = first_row_length(input.board, rig.printed_mm(0, 10), 0.002);
    const auto solved = solve_calibration(input);
    ASSERT_TRUE(solved) << solved.error().message;
    EXPECT_LT(std::abs(rig.error_of(solved->calibration).scale_ppm), 60.0) << seed;
    EXPECT_LT(solved->board.scale_sigma, 4e-5);
    EXPECT_NEAR(length_on_board(input.board, solved->board, *input.length), input.length->measured_mm, 0.002);
  }
}

TEST(SolveCalibration, HandHeldBoardsGiveTheStereoPair) {
  SyntheticBoardRig rig({}, 13);
  const auto solved = solve_calibration(rig.observe_hand_held(20));
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_FALSE(solved->sigma.has_value());
  EXPECT_TRUE(solved->calibration.left.camera_from_turntable.isApprox(Transform::Identity(), 1e-12));
  const Eigen::Isometry3d found = solved->calibration.right.camera_from_turntable;
  EXPECT_NEAR(found.inverse().translation().norm(), rig.stereo().inverse().translation().norm(), 0.1);
  EXPECT_LT(rotation_angle(found.linear().transpose() * rig.stereo().linear()), 1e-3);
}

TEST(SolveCalibration, RefusesWhatItCannotSolve) {
  SyntheticBoardRig rig({}, 14);
  CalibrationInput input = rig.observe();
  const auto code_of = [](const CalibrationInput& wrong) {
    const auto solved = solve_calibration(wrong);
    return solved ? "solved" : std::string(to_string(solved.error().code));
  };
  CalibrationInput wrong = input;
  wrong.nominal_focal_px = 0.0;
  EXPECT_EQ(code_of(wrong), "invalid_input");
  wrong = input;
  wrong.length = MeasuredLength{100.0, 100.0, 0.0};
  EXPECT_EQ(code_of(wrong), "invalid_input");
  wrong.length = MeasuredLength{100.0, 100.0, 0.01, std::array<int, 2>{0, 88}};
  EXPECT_EQ(code_of(wrong), "invalid_input");
  wrong = input;
  wrong.pairs[3].left.corners[5].id = 88;
  EXPECT_EQ(code_of(wrong), "invalid_input");
  wrong = input;
  wrong.pairs.resize(1);
  EXPECT_EQ(code_of(wrong), "degenerate");
  wrong = input;
  for (auto& pair : wrong.pairs) pair.angle_rad = 0.0;  // the table does not turn
  EXPECT_EQ(code_of(wrong), "degenerate");
}

TEST(SolveCalibration, StopsOnRequest) {
  SyntheticBoardRig rig({}, 15);
  std::stop_source source;
  source.request_stop();
  const auto solved = solve_calibration(rig.observe(), {source.get_token(), {}});
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
