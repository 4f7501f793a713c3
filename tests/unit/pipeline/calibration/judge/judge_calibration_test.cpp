#include "pipeline/calibration/judge/judge_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/pipeline/calibration/synthetic_board_rig.h"

namespace scanrig {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST(JudgeCalibration, ACleanRigIsGradeAWithoutASentence) {
  SyntheticBoardRig rig({}, 101);
  const auto judged = judge_calibration(rig.observe());
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_EQ(to_string(judged->judgement.grade), "A");
  ASSERT_TRUE(judged->judgement.cross_validation);
  EXPECT_LT(judged->judgement.cross_validation->ratio(), 1.5);
  EXPECT_GT(judged->judgement.cross_validation->difference, 0.2);
  double sum = 0.0;
  const auto& shifts = judged->judgement.cross_validation->shifts;
  for (const PointShift& shift : shifts) sum += shift.shift_um.squaredNorm();
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(shifts.size())), judged->judgement.cross_validation->difference,
              1e-9);
  EXPECT_THAT(judged->judgement.sentences, IsEmpty());
}

TEST(JudgeCalibration, ABoardThatHardlyFillsTheImageIsNamedWithWhatIsMissing) {
  RigFaults faults;
  faults.noise_px = 0.1;
  SyntheticBoardRig rig(faults, 110);
  CalibrationInput input = rig.observe(3);
  for (BoardPair& pair : input.pairs) {  // a smaller board: its inner corners
    for (BoardSight* sight : {&pair.left, &pair.right}) {
      std::erase_if(sight->corners, [&](const CornerObservation& corner) {
        const int column = corner.id % input.board.corner_columns(), row = corner.id / input.board.corner_columns();
        return column < 3 || column > 7 || row < 2 || row > 5;
      });
    }
  }
  const auto judged = judge_calibration(input);
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_NE(to_string(judged->judgement.grade), "A");
  EXPECT_THAT(judged->judgement.sentences,
              Contains(AllOf(StartsWith("Points uncertain by "), HasSubstr("Use a larger one"))));
}

TEST(JudgeCalibration, ALensThatBrownDoesNotKnowShowsBetweenAAndB) {
  RigFaults faults;
  faults.lens_px = 0.1;
  SyntheticBoardRig rig(faults, 102);
  CalibrationInput input = rig.observe();
  input.lens_field = false;
  const auto judged = judge_calibration(input);
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_GT(judged->judgement.cross_validation->ratio(), 2.5);
  EXPECT_NE(to_string(judged->judgement.grade), "A");
  EXPECT_THAT(judged->judgement.sentences, Contains(HasSubstr("A and B differ by")));
}

TEST(JudgeCalibration, ACameraThatMovedHalfWayIsNamed) {
  RigFaults faults;
  faults.noise_px = 0.05;
  faults.moved_px = 0.05;
  SyntheticBoardRig rig(faults, 103);
  const auto judged = judge_calibration(rig.observe());
  ASSERT_TRUE(judged) << judged.error().message;
  ASSERT_TRUE(judged->judgement.change);
  EXPECT_EQ(judged->judgement.change->kind, RigChange::Kind::camera);
  EXPECT_EQ(judged->judgement.change->camera, 1);
  EXPECT_EQ(judged->judgement.change->placement, 3);
  EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Right camera moved after placement 3 (0.0")));
  EXPECT_NE(to_string(judged->judgement.grade), "A");
}

TEST(JudgeCalibration, AHeavyKnockIsNamedThoughItsImagesAreLeftOut) {
  for (const double px : {0.3, 1.0, 4.0}) {
    RigFaults faults;
    faults.moved_px = px;
    SyntheticBoardRig rig(faults, 109);
    const auto judged = judge_calibration(rig.observe());
    ASSERT_TRUE(judged) << judged.error().message;
    ASSERT_TRUE(judged->judgement.change) << px;
    EXPECT_EQ(judged->judgement.change->kind, RigChange::Kind::camera) << px;
    EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Right camera moved after placement 3"))) << px;
    EXPECT_GT(judged->judgement.graded_um, 40.0) << px;
    EXPECT_EQ(to_string(judged->judgement.grade), "refused") << px;
  }
}

TEST(JudgeCalibration, AFocusThatChangedIsToldFromAKnock) {
  for (const double focus : {0.0005, 0.003}) {
    RigFaults faults;
    faults.focus = focus;
    SyntheticBoardRig rig(faults, 110);
    const auto judged = judge_calibration(rig.observe());
    ASSERT_TRUE(judged) << judged.error().message;
    EXPECT_THAT(judged->judgement.sentences,
                Contains(StartsWith("Focus of the right camera changed after placement 3")))
        << focus;
    EXPECT_EQ(to_string(judged->judgement.grade), "refused");
  }
}

TEST(JudgeCalibration, AColdRigIsToldFromAKnock) {
  for (const double px : {0.1, 0.5}) {
    RigFaults faults;
    faults.drift_px = px;
    SyntheticBoardRig rig(faults, 111);
    const auto judged = judge_calibration(rig.observe());
    ASSERT_TRUE(judged) << judged.error().message;
    EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Right camera drifted by 0."))) << px;
    EXPECT_NE(to_string(judged->judgement.grade), "A") << px;
  }
}

TEST(JudgeCalibration, ABoardThatSlippedIsNamed) {
  RigFaults faults;
  faults.slipped_placement = 5;
  SyntheticBoardRig rig(faults, 104);
  const auto judged = judge_calibration(rig.observe());
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Board slipped in placement 5")));
}

// What no slip can explain shows as small slips everywhere.
TEST(JudgeCalibration, AnAxisThatRunsOutIsNoSlip) {
  RigFaults faults;
  faults.runout_mm = 0.02;
  const auto judged = judge_calibration(SyntheticBoardRig(faults, 102).observe());
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_THAT(judged->judgement.sentences, Not(Contains(StartsWith("Board slipped"))));
}

TEST(JudgeCalibration, ASecondLengthThatContradictsIsRefused) {
  RigFaults faults;
  faults.board_scale = 1.003;
  SyntheticBoardRig rig(faults, 105);
  CalibrationInput input = rig.observe();
  const auto alone = judge_calibration(input);
  ASSERT_TRUE(alone);
  EXPECT_EQ(to_string(alone->judgement.grade), "A");  // no image shows it
  input.second_length = MeasuredLength{200.0, 200.6, 0.02};
  const auto judged = judge_calibration(input);
  ASSERT_TRUE(judged);
  EXPECT_EQ(to_string(judged->judgement.grade), "refused");
  EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Second length differs by 0.30 %")));
}

TEST(JudgeCalibration, WithoutALengthItIsGradeCAtBest) {
  SyntheticBoardRig rig({}, 106);
  CalibrationInput input = rig.observe();
  input.length.reset();
  for (auto& corner : input.pairs[10].left.corners) corner.blur_px = 2.0;
  const auto judged = judge_calibration(input);
  ASSERT_TRUE(judged);
  EXPECT_EQ(to_string(judged->judgement.grade), "C");
  EXPECT_THAT(judged->judgement.sentences, Contains("No measured length: sizes uncertain by 0.3 %."));
  EXPECT_THAT(judged->judgement.sentences, Contains("Placement 2 image 4 blurred, left out: focus or settling."));
}

TEST(JudgeCalibration, ATableThatTurnsTheOtherWayByAnotherGearIsRefused) {
  RigFaults faults;
  faults.gear = -1.00334;
  faults.axis_tilt_deg = 0.06;
  SyntheticBoardRig rig(faults, 107);
  CalibrationInput input = rig.observe();
  input.gear_ratio = 90.0;
  const auto judged = judge_calibration(input);
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_EQ(to_string(judged->judgement.grade), "refused");
  EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Table turns the other way")));
  EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Gear ratio 89.7")));
  EXPECT_THAT(judged->judgement.sentences, Contains(StartsWith("Axis and table top 0.06 deg")));
}

TEST(JudgeCalibration, SwappedCamerasAreNamed) {
  SyntheticBoardRig rig({}, 108);
  CalibrationInput input = rig.observe();
  for (auto& pair : input.pairs) std::swap(pair.left, pair.right);
  const auto judged = judge_calibration(input);
  ASSERT_TRUE(judged) << judged.error().message;
  EXPECT_EQ(to_string(judged->judgement.grade), "refused");
  ASSERT_FALSE(judged->judgement.sentences.empty());
  EXPECT_EQ(judged->judgement.sentences.front(), "Left and right cameras swapped: exchange the serials.");
}

}  // namespace
}  // namespace scanrig
