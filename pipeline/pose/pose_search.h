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
  FreeTurn weakest{};  ///< the turn that the shared surface holds least
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

/// Judges all with one tolerance, the spread of the best fitting hypothesis that covers enough; the best comes first.
void judge(std::vector<Hypothesis>& field, const PoseOptions& options);

/// For a best one that is judged and that still contradicts more than a right one does: proposes all turns of the best
/// ones about the axes that are held least as well, and keeps more of all in each round. Of the whole field the best
/// distinct ones are kept.
void search_wider(std::vector<Hypothesis>& field, const PoseInput& pose1, const PoseInput& pose2,
                  const PoseOptions& options, Scene& scene);

/// The best one again from some degrees to either side about the axis that is held least: a small part that alone holds
/// a turn is missed from far.
void turn_finely(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options);

/// Refines the candidates that are not yet separable at full resolution, and a best one that would be refused as it is;
/// the others stay behind these finalists.
void settle(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options);

double apart_deg(const Candidate& a, const Candidate& b);
/// Degrees between the vertical of pose 2 and that of pose 1.
double tilt_deg(const Transform& pose1_from_pose2);
/// True for another solution that the measurements do not separate from `best`.
bool is_rival(const Candidate& c, const Candidate& best, const PoseOptions& options);
std::vector<const Candidate*> rivals_of(const std::vector<Hypothesis>& field, const PoseOptions& options);

}  // namespace scanrig
