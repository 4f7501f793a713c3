#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/pose/agreement.h"
#include "pipeline/pose/rest_pairs.h"
#include "pipeline/pose/stable_rests.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

/// One pose: its partial model and the registered views it was made from, both in its own turntable frame, mm.
struct PoseInput {
  const Mesh& solid;  ///< closed; what no view measured is closed by hull and table
  std::span<const View> views;
};

struct PoseOptions {
  enum class Rests { hull, egi };
  Rests rests = Rests::hull;
  StableRestOptions stable;
  RestPairOptions pairs;
  bool stable_tangent_planes = true;  ///< the paper's way
  bool point_pairs = true;            ///< global search without rests, for an object on putty or pins
  double same_deg = 10.0;             ///< hypotheses closer than this are one
  double same_rest_tilt_deg = 5.0;    ///< a motion that tilts the object less than this has not turned it over
  double min_overlap = 0.06;          ///< confirmed share of both surfaces
  double max_contradicted = 0.25;     ///< contradicted share of what was judged
  double worst_median = 0.006;        ///< median distance as a share of the object's size
};

/// A motion between the poses after refinement, with the verdict on it.
struct Candidate {
  Transform pose1_from_pose2 = Transform::Identity();
  std::string generator;                              ///< "hull", "egi", "point pairs" or "turn on the table"
  Eigen::Vector3d normal1 = Eigen::Vector3d::Zero();  ///< n_T1 and n_T2 of the pair it came from; 0 for point pairs
  Eigen::Vector3d normal2 = Eigen::Vector3d::Zero();
  std::vector<Contact> contacts;  ///< with the tables, for the refinement
  Agreement agreement;
  double angle_to_best_deg = 0.0;
  int contradicted_more = 0;  ///< samples that speak against it and not against the best, less the other way round
  bool separable = false;     ///< that is more than chance
};

struct PoseEstimate {
  Transform pose1_from_pose2 = Transform::Identity();  ///< refined on the second finest level
  Candidate best;
  /// The others that were refined to the end, best first; the runner-up is the first more than `same_deg` away.
  std::vector<Candidate> alternatives;
  RestCounts counts1, counts2;  ///< tangent planes of either solid after each test
  int pairs = 0;                ///< of rests
  int hypotheses = 0;           ///< motions generated
  int refined = 0;              ///< motions aligned at all
  double overlap = 0.0;
  double condition = 0.0;  ///< of the refinement, see RefinedPose
};

/// How pose 2 lies in pose 1's frame: pairs of stable tangent planes [Park and Subbarao 2002, section 3] and, as a
/// second generator, votes of oriented point pairs; all hypotheses refined on and judged by the range images of both
/// poses, free space and silhouettes, nothing trimmed in the verdict. Same bits for any number of threads. Fails with
/// `not_closed` and `degenerate` (a solid or a measured surface that is none), `no_overlap` (no hypothesis fits),
/// `same_rest` (the object was not turned over), `ambiguous` (more than one answer fits; the message lists them),
/// `stopped`.
Result<PoseEstimate> estimate_pose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                   const Context& context);

}  // namespace scanrig
