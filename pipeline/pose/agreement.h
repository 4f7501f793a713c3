#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/registration/refine_pose.h"

namespace scanrig {

/// What the other pose says about one point of a pose's surface, once a motion between the poses is assumed.
struct SampleCheck {
  enum class Kind : std::uint8_t {
    unknown,    ///< nobody looked there, or something is in front of it
    surface,    ///< a surface was measured next to it
    free_space  ///< a camera looked through it: at the background, past the silhouette or at something behind it
  };
  Kind kind = Kind::unknown;
  float distance_mm = 0.0F;  ///< `surface`: point to plane, positive outside
  float sigma_mm = 0.0F;     ///< `surface`: of the distance
};

/// A pose as a witness: its measured surface and its views' silhouettes.
struct PoseObservations {
  const MeasuredPose* measured = nullptr;
  std::span<const View> views;
};

/// Testimonies for all samples of pose 2, then all of pose 1, on one level, nothing trimmed. `reach_mm`: farther in
/// front of a measured surface is free space, farther behind it is unknown.
std::vector<SampleCheck> check_samples(const PoseObservations& pose1, const PoseObservations& pose2,
                                       const Transform& pose1_from_pose2, int level, double reach_mm);

/// Testimonies in numbers.
struct Agreement {
  double confirmed = 0.0;     ///< shares of all samples
  double contradicted = 0.0;  ///< in free space, or off the surface by more than its tolerance
  double free_space = 0.0;    ///< the part of `contradicted` that lies in free space
  double median_mm = 0.0;     ///< of the distances to the surface; NaN without any
  [[nodiscard]] double score() const { return confirmed - 2.0 * contradicted; }
};

/// Counts with a tolerance of 4 standard deviations, sigma joined by `spread_mm`, what sigma does not know.
Agreement count_agreement(const std::vector<SampleCheck>& sample_checks, double spread_mm);

/// How many more samples contradict `second` alone than `first` alone, and whether that is more than chance: McNemar's
/// test at 4 standard deviations, once at the tolerance above and once at three times it, where a small feature stands
/// out from the noise of edges.
struct AgreementGap {
  int contradicted_more = 0;
  bool separable = false;
};
AgreementGap compare(const std::vector<SampleCheck>& first, const std::vector<SampleCheck>& second, double spread_mm);

}  // namespace scanrig
