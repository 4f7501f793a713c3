#pragma once

#include <vector>

#include "pipeline/pose/estimate_pose.h"

/// The search of estimate_pose(): hypotheses, narrowed and judged. Internal to this folder.
namespace scanrig {

/// A candidate during the search, with its checks.
struct Hypothesis {
  Candidate candidate;
  std::vector<SampleCheck> sample_checks;
  double score = 0.0;
  double condition = 0.0;
  FreeTurn weakest_turn{};  ///< the turn that the shared surface holds least
  /// The motion that it holds least: turn (rad) about `centre` and slide for 1 mm at the object's outside.
  Eigen::Matrix<double, 6, 1> weakest_motion = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// Inputs of the search from both poses.
struct Scene {
  RestingSolid solid1, solid2;
  std::vector<RestPair> pairs;
  MeasuredPose measured1, measured2;
  PoseObservations observations1, observations2;
  double size_mm = 0.0;
  Eigen::Vector3d middle2 = Eigen::Vector3d::Zero();  ///< of pose 2's object
};

Result<Scene> set_scene(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options);

/// Motions between the poses by all generators that `options` allow; fills in the counts. "Not turned over" is always
/// among them: it can only be refused if it was tried.
Result<std::vector<Hypothesis>> propose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                        Scene& scene, PoseEstimate& estimate);

/// Aligns and checks all; the best distinct ones are kept.
void narrow(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options, const SearchRound& round);

/// The first ones of a sorted field that are `apart_deg` or some way from one another.
void keep_distinct(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options, std::size_t count,
                   double apart_deg);

/// Judges all with one tolerance, the spread of the best fitting hypothesis that covers enough; the best comes first.
void judge(std::vector<Hypothesis>& field, const PoseOptions& options);

/// For a best one that is judged and held badly: adds its turns about the axis that is held least. The best distinct
/// ones are kept.
void search_turns(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options);

/// For a best one that is judged and that still contradicts more than a right one does: proposes anew, keeps more in
/// each round, and adds turns of the best ones. Of the whole field the best distinct ones are kept.
void search_wider(std::vector<Hypothesis>& field, const PoseInput& pose1, const PoseInput& pose2,
                  const PoseOptions& options, Scene& scene);

/// Moves the best ones, where they are held badly, along what the shared surface holds least to where they contradict
/// least: alignment loses a turn that a small part alone holds, and slides along upright sides. `judged`: the round
/// that checked them.
void vary_weakest(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options,
                  const SearchRound& judged);

/// Refines the candidates that are not yet separable at full resolution, and a best one that would be refused or
/// searched for again as it is; the others stay behind these finalists. vary_weakest() moves those that are held badly.
void settle(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options);

/// The turn that the surfaces' correspondences hold least.
FreeTurn weakest_turn_of(const RefinedPose& aligned);

double apart_deg(const Candidate& a, const Candidate& b);
/// Degrees between the vertical of pose 2 and that of pose 1.
double tilt_deg(const Transform& pose1_from_pose2);
/// True for another solution that the measurements do not separate from `best`.
bool is_rival(const Candidate& c, const Candidate& best, const PoseOptions& options);
std::vector<const Candidate*> rivals_of(const std::vector<Hypothesis>& field, const PoseOptions& options);

}  // namespace scanrig
