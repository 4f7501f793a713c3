#include "pipeline/reconstruct/pose_sentences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/units.h"
#include "pipeline/registration/pose_uncertainty.h"

namespace scanrig {
namespace {

// One standard deviation beyond which a person is told: several times what a part that holds its pose has.
constexpr double kWellKnownDeg = 0.05;
constexpr double kWellKnownMm = 0.05;
constexpr double kUprightDeg = 15.0;  // from the vertical, or from the horizontal, that is still called so

std::string sentence_of(std::string text) {
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text + ".";
}

/// As the part stood in pose 1.
std::string axis_of(const Eigen::Vector3d& direction) {
  const double tilt_deg = to_degrees(std::acos(std::min(std::abs(direction.y()), 1.0)));
  if (tilt_deg < kUprightDeg) return "the axis that was vertical in pose 1";
  if (tilt_deg > 90.0 - kUprightDeg) return "an axis that was horizontal in pose 1";
  return fmt::format("an axis {:.0f} deg from the vertical of pose 1", tilt_deg);
}

}  // namespace

std::string turn_sentence(const PoseEstimate& estimate, const ColourDecision* colours) {
  const char* how = "; nothing shows how it was turned";
  if (colours != nullptr && colours->is_decided) how = "; its colours show how it was turned";
  if (colours != nullptr && !colours->is_decided) {
    how = "; nothing shows how it was turned, so each place has the colours of one pose alone";
  }
  const bool is_assumed = estimate.turned_over_is_assumed && !(colours != nullptr && colours->is_decided);
  return sentence_of(describe(estimate.symmetry) + how + (is_assumed ? "; it is taken for turned over" : ""));
}

std::string weakness_sentence(std::size_t pose, const Eigen::Matrix<double, 6, 6>& covariance, bool is_turn_open) {
  const PrincipalSigmas turns = principal_sigmas(covariance.topLeftCorner<3, 3>());
  const PrincipalSigmas slides = principal_sigmas(covariance.bottomRightCorner<3, 3>());
  const double turn_deg = is_turn_open ? 0.0 : to_degrees(turns.sigma[0]);
  const double slide_mm = slides.sigma[0];
  if (turn_deg <= kWellKnownDeg && slide_mm <= kWellKnownMm) return "";
  const bool is_turn = turn_deg / kWellKnownDeg > slide_mm / kWellKnownMm;
  const std::string axis = axis_of((is_turn ? turns : slides).directions.col(0));
  return is_turn ? fmt::format("Pose {} may be turned by {:.2f} deg (1 sigma) about {}: add a pose to make sure.",
                               pose + 1, turn_deg, axis)
                 : fmt::format("Pose {} may be off by {:.2f} mm (1 sigma) along {}: add a pose to make sure.", pose + 1,
                               slide_mm, axis);
}

}  // namespace scanrig
