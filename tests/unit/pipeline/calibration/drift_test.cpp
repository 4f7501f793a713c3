#include "pipeline/calibration/drift/check_drift.h"

#include <gmock/gmock.h>

#include "pipeline/calibration/solve/solve_calibration.h"
#include "pipeline/calibration/solve/volume_error.h"
#include "tests/unit/pipeline/calibration/synthetic_board_rig.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Drift : public testing::Test {
 protected:
  static constexpr unsigned kRigs = 5;

  static RigFaults faults() {
    RigFaults faults;
    faults.noise_px = 0.03;
    faults.print_mm = 0.008;
    faults.warp_mm = 0.1;
    faults.gear_deg = 0.01;
    faults.runout_mm = 0.002;
    faults.lens_px = 0.03;
    return faults;
  }
  /// A rig with its calibration, and what it shows later of placement 1.
  struct Calibrated {
    explicit Calibrated(unsigned seed) : rig(faults(), seed) {
      const auto input = rig.observe();
      board = input.board;
      const auto solved = solve_calibration(input);
      known = solved.value().calibration;
      known.quality.emplace().board = solved->board;
      for (const BoardPair& pair : rig.observe(6).pairs) {
        if (pair.placement == 1) pairs.push_back(pair);
      }
    }
    SyntheticBoardRig rig;
    Board board;
    Calibration known;
    std::vector<BoardPair> pairs;
  };
  static const Calibrated& rig(unsigned seed) {
    static std::array<std::unique_ptr<Calibrated>, kRigs> made;
    if (!made[seed]) made[seed] = std::make_unique<Calibrated>(seed + 11);
    return *made[seed];
  }
  /// `known` as if the right camera had stood turned by so much that points of the volume are `um` off.
  static Calibration turned(const Calibration& known, double um) {
    Calibration other = known;
    const auto grid = volume_grid(known);
    const auto turn = [&](double angle) {
      other.right.camera_from_turntable =
          small_motion({0.0, angle, 0.0}, Eigen::Vector3d::Zero()) * known.right.camera_from_turntable;
      return 1e3 * rms_per_point(VolumeParts(grid).without_scale_and_base(volume_difference(known, other, grid)));
    };
    constexpr double kProbe = 1e-5;
    turn(um > 0.0 ? kProbe * um / turn(kProbe) : 0.0);
    return other;
  }
};

TEST_F(Drift, AnUntouchedRigHoldsAndALittleMore) {
  for (unsigned seed = 0; seed < kRigs; ++seed) {
    for (const double um : {0.0, 5.0}) {
      const auto check = check_drift(turned(rig(seed).known, um), rig(seed).board, rig(seed).pairs);
      ASSERT_TRUE(check) << check.error().message;
      EXPECT_EQ(check->verdict, DriftVerdict::holds) << seed << ": " << check->difference_um;
      EXPECT_LT(check->sigma_um, 5.0);
      EXPECT_THAT(check->sentences.front(), StartsWith("The calibration holds: "));
    }
  }
}

TEST_F(Drift, ACameraThatTurnedIsMeasuredAndItsNewPoseOffered) {
  for (unsigned seed = 0; seed < kRigs; ++seed) {
    const auto check = check_drift(turned(rig(seed).known, 20.0), rig(seed).board, rig(seed).pairs);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_EQ(check->verdict, DriftVerdict::moved) << check->difference_um;
    EXPECT_NEAR(check->difference_um, 20.0, 8.0);
    EXPECT_THAT(check->sentences.front(), HasSubstr("Accept the new poses."));
    EXPECT_LT(rig(seed).rig.error_of(check->calibration).rms, 8.0);
  }
}

TEST_F(Drift, FurtherOffTheRigIsCalibrated) {
  for (unsigned seed = 0; seed < kRigs; ++seed) {
    const auto check = check_drift(turned(rig(seed).known, 50.0), rig(seed).board, rig(seed).pairs);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_EQ(check->verdict, DriftVerdict::calibrate) << seed << ": " << check->difference_um;
    EXPECT_THAT(check->sentences.front(), HasSubstr("Calibrate the rig."));
  }
}

TEST_F(Drift, TheAxisIsTakenApartFromTheCameras) {
  Calibration other = rig(1).known;
  for (Camera* camera : {&other.left, &other.right}) {
    camera->camera_from_turntable = camera->camera_from_turntable * Eigen::Translation3d(0.0, 0.0, 0.02);
  }
  const auto check = check_drift(other, rig(1).board, rig(1).pairs);
  ASSERT_TRUE(check) << check.error().message;
  EXPECT_NEAR(check->axis_mm, 0.02, 0.006);
  EXPECT_LT(check->cameras_px.norm(), 0.015);
}

TEST_F(Drift, WhatCannotBeCheckedSaysWhy) {
  auto first = rig(0).known;
  first.quality.reset();
  EXPECT_EQ(check_drift(first, rig(0).board, rig(0).pairs).error().code, ErrorCode::unsupported);
  Board other = rig(0).board;
  other.rows += 2;
  EXPECT_EQ(check_drift(rig(0).known, other, rig(0).pairs).error().code, ErrorCode::unsupported);
  auto few = rig(0).pairs;
  few.resize(3);
  EXPECT_THAT(check_drift(rig(0).known, rig(0).board, few).error().message, HasSubstr("3 images"));
  auto slipped = rig(0).pairs;
  for (std::size_t i = 3; i < slipped.size(); ++i) {
    for (auto& corner : slipped[i].left.corners) corner.pixel.x() += 3.0;
  }
  EXPECT_THAT(check_drift(rig(0).known, rig(0).board, slipped).error().message, HasSubstr("moved"));
}

}  // namespace
}  // namespace scanrig
