#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/registration/refine_pose.h"

namespace scanrig {

/// Check of one point of a pose's surface against the other pose, for an assumed motion between the poses.
struct SampleCheck {
  enum class Kind : std::uint8_t {
    unknown,    ///< not observed, or something is in front of it
    surface,    ///< a surface was measured next to it
    free_space  ///< a camera looked through it: at the background, past the silhouette or at something behind it
  };
  Kind kind = Kind::unknown;
  float distance_mm = 0.0F;  ///< `surface`: point to plane, positive outside
  float sigma_mm = 0.0F;     ///< `surface`: of the distance
};

/// Limits of the checks.
struct AgreementOptions {
  double min_facing = 0.25;      ///< cosine below which a view does not judge a point
  double min_agreement = 0.6;    ///< cosine between corresponding normals
  double silhouette_px = 2.0;    ///< farther outside a silhouette than this is outside
  std::size_t witnesses = 3;     ///< views that look through a point, or a third of them, make it free space
  int clear_px = 2;              ///< free space must also hold for neighbours at this distance
  double tolerance = 4.0;        ///< standard deviations off the surface that contradict
  double wide_tolerance = 12.0;  ///< the same, for small features that are distinct from the noise of edges
  double separable = 4.0;        ///< standard deviations of McNemar's test
  bool has_table = true;         ///< y = 0 is a table: surface far below it is in free space
};

/// The observations of a pose: its measured surface and its views' silhouettes.
struct PoseObservations {
  const MeasuredPose* measured = nullptr;
  std::span<const View> views;
};

/// Check of a point of another pose, carried into this pose's frame, by images of `level`. `reach_mm`: as of
/// check_samples().
SampleCheck check_sample(const PoseObservations& observations, int level, const SurfacePoint& sample, double reach_mm,
                         const AgreementOptions& options);

/// Checks of all samples of pose 2, then all of pose 1, of one level, nothing trimmed. Images of the next finer level
/// judge them: what is thin, such as a handle, is lost in an average. `reach_mm`: farther in front of a measured
/// surface is free space, farther behind it is unknown.
std::vector<SampleCheck> check_samples(const PoseObservations& pose1, const PoseObservations& pose2,
                                       const Transform& pose1_from_pose2, int level, double reach_mm,
                                       const AgreementOptions& options);

/// True for a sample in free space, or `tolerance` standard deviations off the surface; `spread_mm`, the error not
/// covered by sigma, is added to sigma.
bool contradicts(const SampleCheck& check, double spread_mm, double tolerance);

/// Summary of the checks.
struct Agreement {
  double confirmed = 0.0;     ///< shares of all samples
  double contradicted = 0.0;  ///< in free space, or off the surface by more than its tolerance
  double free_space = 0.0;    ///< the part of `contradicted` that lies in free space
  double median_mm = 0.0;     ///< of the distances to the surface; NaN without any
  [[nodiscard]] double score(double contradiction_weight) const {
    return confirmed - contradiction_weight * contradicted;
  }
  /// Of what was judged.
  [[nodiscard]] double contradicted_share() const { return contradicted / std::max(confirmed + contradicted, 1e-9); }
};

/// Counts with `options.tolerance`.
Agreement count_agreement(const std::vector<SampleCheck>& sample_checks, double spread_mm,
                          const AgreementOptions& options);

/// Number of samples that contradict `second` alone less those that contradict `first` alone, and whether that exceeds
/// chance: McNemar's test, once at either tolerance.
struct AgreementGap {
  int contradicted_more = 0;
  bool separable = false;
};
AgreementGap compare(const std::vector<SampleCheck>& first, const std::vector<SampleCheck>& second, double spread_mm,
                     const AgreementOptions& options);

}  // namespace scanrig
