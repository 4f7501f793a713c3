#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/pose/agreement.h"
#include "pipeline/pose/point_pairs.h"
#include "pipeline/pose/rest_pairs.h"
#include "pipeline/pose/stable_rests.h"
#include "pipeline/pose/symmetry.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

/// One pose: its partial model and the registered views it was made from, both in its own turntable frame, mm.
struct PoseInput {
  const Mesh& solid;  ///< closed; unmeasured surface is closed by hull and table
  std::span<const View> views;
  const MeasuredPose* measured = nullptr;  ///< measured_pose(views, PoseOptions::levels), where it is made already
};

/// One narrowing of the candidates: align, check the samples, keep the best distinct ones.
struct SearchRound {
  int level;         ///< of the range pyramid
  int iterations;    ///< of the alignment before judging; 0: judge only
  double capture;    ///< capture distance as a share of the object's size
  double reach;      ///< of the checks, as a share of the object's size
  std::size_t keep;  ///< best hypotheses that are kept
  double apart_deg;  ///< minimum angle between them
  /// A contradiction counts as much as so many confirmations. The better aligned, the more it tells: of a part that is
  /// nearly symmetric a wrong motion may confirm three times as much surface as the right one.
  double contradiction_weight;
};

struct PoseOptions {
  enum class Rests { hull, egi };
  Rests rests = Rests::hull;
  StableRestOptions stable;
  RestPairOptions pairs;
  bool stable_tangent_planes = true;         ///< the paper's way
  bool point_pairs = true;                   ///< global search without rests, for an object on putty or pins
  double same_deg = 10.0;                    ///< hypotheses closer than this are one
  double same_rest_tilt_deg = 5.0;           ///< a motion that tilts the object less than this has not turned it over
  double min_overlap = 0.06;                 ///< confirmed share of both surfaces
  double max_contradicted = 0.1;             ///< contradicted share of what was judged
  double max_denied_by_images = 0.25;        ///< the same, if it is free space alone and nothing else leaves a doubt
  double search_again_contradicted = 0.012;  ///< a best motion beyond this share is searched for again, more widely
  double weak_condition = 3e3;               ///< a motion beyond this is tried along what is held least
  double max_median = 0.006;                 ///< median distance as a share of the object's size
  double rival_share = 0.7;                  ///< a rival confirms at least this share of what the best one confirms
  double same_shift = 0.05;                  ///< hypotheses closer than this share of the object's size are one

  int levels = 4;                ///< of the range pyramid; the last has some 300 samples per pose
  std::size_t min_samples = 50;  ///< of a pose's measured surface on the second last level
  int point_pair_motions = 40;   ///< hypotheses from point pairs
  std::array<SearchRound, 4> rounds = {{{3, 0, 0.00, 0.050, 120, 4.0, 1.0},   // as proposed
                                        {3, 10, 0.10, 0.040, 16, 5.0, 1.0},   // coarse
                                        {2, 15, 0.05, 0.025, 8, 5.0, 1.0},    // middle
                                        {1, 15, 0.02, 0.015, 8, 5.0, 1.0}}};  // verdict
  SearchRound last_round = {0, 10, 0.01, 0.015, 0, 0.0, 7.0};  ///< for rivals; keeps all that are `same_deg` apart
  AgreementOptions agreement;
  PointPairOptions voting;
  SymmetryOptions symmetry;
  double flat_share = 0.004;       ///< of the object's size: surface this near to a table lies flat on it
  double max_unexplained = 0.015;  ///< share of the samples that may show the object twice as it stood
  /// Picked by a person: of motions that fit and give different surfaces, the one within `same_deg` of this is it.
  std::optional<Transform> picked{};
  double min_turned_over_deg = 30.0;  ///< of motions that fit equally well one with this tilt, or less than its
                                      ///< supplement, is preferred: both poses then share surface from all sides
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
  int contradicted_more = 0;  ///< samples that contradict it and not the best, less those the other way round
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
  /// The motions `symmetry.elements[i] * pose1_from_pose2`, and all free turns of them, fit as well as this one and
  /// give the same surface. `none`: no other does.
  Symmetry symmetry;
  /// Motions that turn the object over and motions that do not fit alike; one that does was taken.
  bool turned_over_is_assumed = false;
  bool is_picked = false;  ///< `options.picked` decided
};

/// Transform from pose 2's frame to pose 1's. Generators: pairs of stable tangent planes [Park and Subbarao 2002,
/// section 3] and votes of oriented point pairs. All hypotheses are refined and judged by the range images of both
/// poses, free space and silhouettes; the verdict trims nothing. Same bits for any number of threads.
/// Several motions that fit and give the same surface, within what sigma and sampling tell, are one answer with a
/// symmetry. Fails with `not_closed` and `degenerate` (no valid solid or measured surface), `no_overlap` (no hypothesis
/// fits), `same_rest` (the object was not turned over), `ambiguous` (several motions fit that give different surfaces;
/// the message has the best two), `stopped`.
Result<PoseEstimate> estimate_pose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                   const Context& context);

/// As estimate_pose(), and into `fitting` the motions that fit and that nothing separates, best first, whether or not
/// they are an answer: other poses may decide between them.
Result<PoseEstimate> estimate_pose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                   const Context& context, std::vector<Candidate>& fitting);

/// For the refinement of a motion that was found by a search, so a fraction of a degree off: coarser levels, trimming
/// and narrow robust weights would lose a turn that a small part of the object alone holds.
RefineOptions after_search();

/// Whether two poses that agree so much fit together. `size_mm`: of the object.
bool fits(const Agreement& agreement, double size_mm, const PoseOptions& options);

/// Whether a motion between poses turns the object over, and not only about the vertical.
bool turns_over(const Transform& pose1_from_pose2, const PoseOptions& options = {});

}  // namespace scanrig
