#include "pipeline/calibration/watch/watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/units.h"
#include "pipeline/calibration/watch/rig_effects.h"
#include "tests/unit/pipeline/calibration/watch/watched_rig.h"

namespace scanrig {
namespace {

using test::kPixel;
using test::RigChange;
using test::WatchedRig;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr unsigned kSeeds = 10;

RigChange right_columns(double px) { return {.right_turn = {0, px * kPixel, 0}}; }
RigChange right_rows(double px) { return {.right_turn = {-px * kPixel, 0, 0}}; }
RigChange axis_off() { return {.table_shift = Eigen::Vector3d(0.03, 0, 0.04), .table_tilt = {to_radians(0.02), 0, 0}}; }

/// Rms over seeds of the volume error before and after the refinement, micrometres.
std::pair<double, double> before_and_after(const RigChange& change) {
  double before = 0.0, after = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    WatchedRig rig(change, seed);
    const Watch watch = watch_rig(rig.observe());
    EXPECT_TRUE(watch.refined);
    before += std::pow(rig.volume_error_um(rig.calibration()), 2) / kSeeds;
    after += std::pow(rig.volume_error_um(*watch.refined), 2) / kSeeds;
  }
  std::cout << "volume " << std::sqrt(before) << " um, refined " << std::sqrt(after) << " um\n";
  return {std::sqrt(before), std::sqrt(after)};
}

const WatchedPart& part_of(const Watch& watch, RigPart part) {
  for (const WatchedPart& p : watch.parts) {
    if (p.part == part) return p;
  }
  ADD_FAILURE() << "no " << to_string(part);
  static const WatchedPart none;
  return none;
}

void print(const Watch& watch) {
  for (const WatchedPart& p : watch.parts) {
    std::cout << to_string(p.part) << ": " << p.px << " px, " << p.volume_um << " um, expected " << p.expected_px
              << ", " << to_string(p.verdict) << "\n";
  }
  for (const auto& s : watch.sentences) std::cout << s << "\n";
}

TEST(Refinement, MendsADisparity) {
  const auto [before, after] = before_and_after(right_columns(0.1));
  EXPECT_NEAR(before, 57.0, 6.0);
  EXPECT_LE(after, 24.0);
}

TEST(Refinement, MendsAnAxis) {
  const auto [before, after] = before_and_after(axis_off());
  EXPECT_GT(before, 35.0);
  EXPECT_LE(after, 20.0);
}

TEST(Refinement, MendsRows) {
  const auto [before, after] = before_and_after(right_rows(0.1));
  EXPECT_LE(after, 20.0);
  WatchedRig rig(right_rows(0.1));
  EXPECT_NEAR(rig.row_error_px(rig.calibration()), 0.1, 0.01);
  EXPECT_LT(rig.row_error_px(*watch_rig(rig.observe()).refined), 0.006);
}

TEST(Refinement, OfAnUntouchedRigAddsLittle) {
  const auto [before, after] = before_and_after({});
  EXPECT_EQ(std::lround(before), 0);
  EXPECT_LE(after, 20.0);
}

TEST(Watch, OfAnUntouchedRigIsSilentInFortyScans) {
  double highest = 0.0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    WatchedRig rig({}, seed);
    const Watch watch = watch_rig(rig.observe());
    EXPECT_EQ(watch.verdict, WatchVerdict::holds) << seed;
    EXPECT_THAT(watch.sentences, IsEmpty());
    for (const WatchedPart& part : watch.parts) highest = std::max(highest, part.px);
  }
  std::cout << "highest of 40: " << highest << " px\n";
  EXPECT_LT(highest, 0.04);
}

TEST(Watch, NamesTheCameraThatMovedAlongRows) {
  WatchedRig rig(right_columns(0.1));
  const Watch watch = watch_rig(rig.observe());
  print(watch);
  EXPECT_EQ(watch.verdict, WatchVerdict::moved);
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Right camera moved by 0.1")));
  EXPECT_NEAR(part_of(watch, RigPart::right_camera).px, 0.1, 0.02);
  EXPECT_NEAR(part_of(watch, RigPart::right_camera).volume_um, 57.0, 12.0);
  EXPECT_EQ(part_of(watch, RigPart::left_camera).verdict, WatchVerdict::holds);
  EXPECT_EQ(part_of(watch, RigPart::axis).verdict, WatchVerdict::holds);
  EXPECT_EQ(part_of(watch, RigPart::rows).verdict, WatchVerdict::holds);
}

TEST(Watch, NamesTheCameraThatMovedAcrossRows) {
  WatchedRig rig({.left_turn = {0.1 * kPixel, 0, 0}});
  const Watch watch = watch_rig(rig.observe());
  print(watch);
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Left camera moved by 0.1")));
  EXPECT_NEAR(part_of(watch, RigPart::rows).px, 0.1, 0.01);
  EXPECT_EQ(part_of(watch, RigPart::right_camera).verdict, WatchVerdict::holds);
}

TEST(Watch, NamesTheAxisWhenBothImagesShiftAlike) {
  WatchedRig rig(axis_off());
  const Watch watch = watch_rig(rig.observe());
  print(watch);
  EXPECT_EQ(watch.verdict, WatchVerdict::moved);
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Table axis moved by 0.05 mm, 0.02")));
  EXPECT_EQ(part_of(watch, RigPart::left_camera).verdict, WatchVerdict::holds);
  EXPECT_EQ(part_of(watch, RigPart::right_camera).verdict, WatchVerdict::holds);
}

// Matching does not depend on the axis, and the dots measure it: it is mended where a camera would be refused.
TEST(Refinement, MendsAnAxisThatIsFarOff) {
  const RigChange far = {.table_shift = Eigen::Vector3d(0.1, 0, 0), .table_tilt = {0, 0, to_radians(0.05)}};
  const auto [before, after] = before_and_after(far);
  EXPECT_GT(before, 60.0);
  EXPECT_LE(after, 20.0);
  const Watch watch = watch_rig(WatchedRig(far).observe());
  EXPECT_EQ(watch.verdict, WatchVerdict::moved);
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Table axis moved by 0.10 mm, 0.05")));
  const RigChange loose = {.table_shift = Eigen::Vector3d(1.5, 0, 0)};
  EXPECT_EQ(watch_rig(WatchedRig(loose).observe()).verdict, WatchVerdict::refused);
}

TEST(Watch, RefusesWithThePartThatMoved) {
  WatchedRig rig(right_columns(0.25));
  const Watch watch = watch_rig(rig.observe());
  EXPECT_EQ(watch.verdict, WatchVerdict::refused);
  ASSERT_FALSE(watch.sentences.empty());
  EXPECT_THAT(watch.sentences.front(), HasSubstr("Right camera moved by 0.2"));
}

TEST(Watch, MeasuresTheTablesAnglesAndIgnoresItsZero) {
  WatchedRig rig({.angle_step_deg = 0.02, .table_zero_deg = 0.2});
  const Watch watch = watch_rig(rig.observe());
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Table angles off by 0.0")));
  EXPECT_NEAR(watch.table_zero_deg, 0.27, 0.01);  // the angles' mean is 3.5 steps off
  ASSERT_EQ(watch.refined_angles_rad.size(), 8u);
  EXPECT_NEAR(to_degrees(watch.refined_angles_rad[7]), 315.0 + 0.2 + 0.14, 0.008);
  WatchedRig zero({.table_zero_deg = 0.2});
  EXPECT_EQ(watch_rig(zero.observe()).verdict, WatchVerdict::holds);
}

TEST(Watch, LeavesOutDotsThatAreSomethingElse) {
  WatchedRig rig({});
  WatchInput input = rig.observe();
  for (WatchView& view : input.views) {
    for (std::size_t i = 0; i < 4; ++i) view.dots[1][i].pixel += Eigen::Vector2d(1.5, -1.0);
  }
  const Watch watch = watch_rig(input);
  print(watch);
  EXPECT_EQ(watch.verdict, WatchVerdict::holds);
}

TEST(Watch, WithoutDotsJudgesRowsAlone) {
  WatchedRig rig(right_rows(0.1));
  WatchInput input = rig.observe();
  for (WatchView& view : input.views) view.dots = {};
  Watch watch = watch_rig(input);
  EXPECT_FALSE(watch.refined);
  EXPECT_EQ(watch.verdict, WatchVerdict::moved);
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Rows of the cameras differ by 0.10 px")));
  for (WatchView& view : input.views) {
    for (RowSighting& row : view.rows) row.offset_px *= 2.0;
  }
  EXPECT_EQ(watch_rig(input).verdict, WatchVerdict::refused);
}

TEST(Watch, IsNotAvailableForACalibrationOfUnknownQuality) {
  WatchedRig rig(right_columns(0.1));
  const WatchInput seen = rig.observe();
  Calibration old = rig.calibration();
  old.quality.reset();
  const Watch watch = watch_rig({old, seen.views, seen.rectified_from_turntable, seen.rectified_focal_px});
  EXPECT_EQ(watch.verdict, WatchVerdict::not_available);
  EXPECT_FALSE(watch.refined);
  EXPECT_THAT(watch.parts, IsEmpty());
}

TEST(Watch, ExpectsMoreOfACalibrationThatIsLessSure) {
  WatchedRig rig(right_columns(0.06));
  const WatchInput seen = rig.observe();
  EXPECT_EQ(watch_rig(seen).verdict, WatchVerdict::moved);
  Calibration unsure = rig.calibration();
  unsure.quality->cameras *= 100.0;
  const Watch watch = watch_rig({unsure, seen.views, seen.rectified_from_turntable, seen.rectified_focal_px});
  print(watch);
  EXPECT_EQ(watch.verdict, WatchVerdict::holds);
}

TEST(Watch, SaysOfOverlapOnlyWhatStereosErrorsDoNotExplain) {
  WatchedRig rig({});
  Watch watch = watch_rig(rig.observe());
  add_overlap(watch, rig.calibration(), 0.005, 0.03);
  EXPECT_EQ(watch.verdict, WatchVerdict::holds);
  add_overlap(watch, rig.calibration(), 0.03, 0.08);
  EXPECT_EQ(watch.verdict, WatchVerdict::moved);
  EXPECT_THAT(watch.sentences, ElementsAre(HasSubstr("Views fit with the axis moved by 0.08 mm")));
}

TEST(AxisSigma, IsThatOfTheCalibrationsCovariance) {
  WatchedRig rig({});
  // Both cameras' places at 3 um each, alike: the axis is as sure as they are.
  CalibrationQuality quality = *rig.calibration().quality;
  quality.cameras.setZero();
  Eigen::MatrixXd shift = Eigen::MatrixXd::Zero(30, 2);
  for (int c = 0; c < 2; ++c) {
    const Eigen::Matrix3d rotation =
        (c == 0 ? rig.calibration().left : rig.calibration().right).camera_from_turntable.linear();
    shift.block<3, 1>(15 * c + 12, 0) = rotation.col(0);
    shift.block<3, 1>(15 * c + 12, 1) = rotation.col(2);
  }
  quality.cameras = std::pow(0.02, 2) * shift * shift.transpose();
  const AxisSigma sigma = axis_sigma(rig.calibration(), quality);
  EXPECT_NEAR(sigma.shift_mm, 0.02, 1e-4);
  EXPECT_NEAR(sigma.tilt_deg, 0.0, 1e-5);
  // Scale moves no axis, however little is known of it.
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(30);
  scale.segment<3>(12) = rig.calibration().left.camera_from_turntable.translation();
  scale.segment<3>(27) = rig.calibration().right.camera_from_turntable.translation();
  quality.cameras = 9e-6 * scale * scale.transpose();
  EXPECT_LT(axis_sigma(rig.calibration(), quality).shift_mm, 1e-3);
}

TEST(PointByCameras, FollowsATableThatBothCamerasSeeElsewhere) {
  WatchedRig rig({});
  const Calibration& calibration = rig.calibration();
  const Eigen::Vector3d point(20.0, 40.0, -10.0), shift(0.1, -0.2, 0.05), turn(1e-3, 2e-3, -5e-4);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(30);
  for (int c = 0; c < 2; ++c) {
    const Eigen::Matrix3d rotation = (c == 0 ? calibration.left : calibration.right).camera_from_turntable.linear();
    change.segment<3>(15 * c + 9) = rotation * turn;
    change.segment<3>(15 * c + 12) = rotation * shift;
  }
  const Eigen::Vector3d moved = point_by_cameras(calibration, point) * change;
  EXPECT_LT((moved - (shift + turn.cross(point))).norm(), 1e-6) << moved.transpose();
}

TEST(PointByCameras, APixelOfOneCameraAloneMovesAlongItsDisparity) {
  WatchedRig rig({});
  const Calibration& calibration = rig.calibration();
  const Eigen::Vector3d point(20.0, 40.0, -10.0);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(30);
  change[15 + 2] = 0.1;  // cx of the right camera
  Calibration other = calibration;
  other.right.projection.cx += 0.1;
  const Eigen::Vector3d at = point - point_by_cameras(calibration, point) * change;
  EXPECT_GT((at - point).norm(), 0.01);
  EXPECT_LT((other.left.project(at) - calibration.left.project(point)).norm(), 0.01);
  EXPECT_LT((other.right.project(at) - calibration.right.project(point)).norm(), 0.01);
}

}  // namespace
}  // namespace scanrig
