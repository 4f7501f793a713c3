#include "pipeline/reconstruct/pose_sentences.h"

#include <gtest/gtest.h>

#include "core/units.h"

namespace scanrig {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Known to 0.01 deg and 0.01 mm but for a turn about one direction and a slide along another.
Matrix6 known_to(const Eigen::Vector3d& axis, double turn_deg, const Eigen::Vector3d& along, double slide_mm) {
  Matrix6 covariance = 1e-4 * Matrix6::Identity();
  covariance.topLeftCorner<3, 3>() *= to_radians(1.0) * to_radians(1.0);
  covariance.topLeftCorner<3, 3>() += to_radians(turn_deg) * to_radians(turn_deg) * axis * axis.transpose();
  covariance.bottomRightCorner<3, 3>() += slide_mm * slide_mm * along * along.transpose();
  return covariance;
}

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitY();
const Eigen::Vector3d kAcross = Eigen::Vector3d::UnitX();

TEST(PoseSentences, SayNothingOfAPoseThatIsKnownWell) {
  EXPECT_EQ(weakness_sentence(1, known_to(kUp, 0.0, kUp, 0.0), false), "");
}

TEST(PoseSentences, NameTheDirectionThatIsKnownLeast) {
  EXPECT_EQ(weakness_sentence(1, known_to(kUp, 0.09, kAcross, 0.02), false),
            "Pose 2 may be turned by 0.09 deg (1 sigma) about the axis that was vertical in pose 1: add a pose to make "
            "sure.");
  EXPECT_EQ(
      weakness_sentence(2, known_to((kUp + kAcross).normalized(), 0.3, kAcross, 0.02), false),
      "Pose 3 may be turned by 0.30 deg (1 sigma) about an axis 45 deg from the vertical of pose 1: add a pose to make "
      "sure.");
  EXPECT_EQ(
      weakness_sentence(1, known_to(kUp, 0.06, kAcross, 0.2), false),
      "Pose 2 may be off by 0.20 mm (1 sigma) along an axis that was horizontal in pose 1: add a pose to make sure.");
}

TEST(PoseSentences, DoNotNameATurnThatChangesNothing) {
  EXPECT_EQ(weakness_sentence(1, known_to(kUp, 40.0, kUp, 0.0), true), "");
  EXPECT_NE(weakness_sentence(1, known_to(kUp, 40.0, kUp, 0.3), true), "");
}

TEST(PoseSentences, SayHowThePartIsSymmetricAndWhatDecided) {
  PoseEstimate estimate;
  estimate.symmetry.group = Symmetry::Group::axial;
  EXPECT_EQ(turn_sentence(estimate, nullptr),
            "The part is the same after every turn about one axis; nothing shows how it was turned.");
  ColourDecision colours;
  colours.is_decided = true;
  EXPECT_EQ(turn_sentence(estimate, &colours),
            "The part is the same after every turn about one axis; its colours show how it was turned.");
}

}  // namespace
}  // namespace scanrig
