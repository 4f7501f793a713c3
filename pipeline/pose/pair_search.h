#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/pose_graph.h"

/// Pairs of a scan's poses: searched once, and judged under other motions. Internal to this folder.
namespace scanrig {

/// What the search of one pair gave.
struct SearchedPair {
  Result<PoseEstimate> estimate;
  std::vector<Candidate> fitting;  ///< motions that nothing separates, best first
};

/// Threads: one user at a time; work inside is spread over the current arena.
class PairSearch {
 public:
  /// `poses` must outlive the object.
  PairSearch(std::span<const PoseInput> poses, const PoseOptions& options);

  /// estimate_pose() of two poses, once. Fails with `stopped` alone; other failures are the pair's answer.
  Result<void> search(std::size_t pose1, std::size_t pose2, const Context& context);
  /// Null: not searched.
  [[nodiscard]] const SearchedPair* searched(std::size_t pose1, std::size_t pose2) const;
  /// Of all pairs that were searched. `with_symmetric`: of a finite symmetry all its motions.
  [[nodiscard]] std::vector<PairMotion> motions(bool with_symmetric) const;
  /// What both poses' range images say, after alignment near the motion. A pair that was searched prefers its own
  /// motion: one that it can tell from that contradicts.
  PairVerdict judge(std::size_t pose1, std::size_t pose2, const Transform& pose1_from_pose2);
  /// Share of what is judged at full resolution, after alignment near the motion.
  [[nodiscard]] double contradicted_finely(std::size_t pose1, std::size_t pose2,
                                           const Transform& pose1_from_pose2) const;

  [[nodiscard]] const PoseGraphOptions& graph_options() const { return graph_options_; }

 private:
  struct Judged {
    std::size_t pair;
    Transform motion;
    PairVerdict verdict;
  };
  struct Checked {
    std::vector<SampleCheck> checks;
    double median_mm = 0.0;
  };
  [[nodiscard]] Checked check(std::size_t pose1, std::size_t pose2, const Transform& motion,
                              const SearchRound& round) const;
  [[nodiscard]] Transform aligned(std::size_t pose1, std::size_t pose2, const Transform& motion,
                                  const SearchRound& round) const;
  [[nodiscard]] bool is_told_apart(const SearchedPair& pair, std::size_t pose1, std::size_t pose2,
                                   const Checked& checked) const;
  [[nodiscard]] PairVerdict judge_anew(std::size_t pose1, std::size_t pose2, const Transform& pose1_from_pose2) const;
  [[nodiscard]] std::size_t index(std::size_t pose1, std::size_t pose2) const { return pose1 * poses_.size() + pose2; }

  std::span<const PoseInput> poses_;
  PoseOptions options_;
  std::vector<MeasuredPose> measured_;
  std::vector<std::optional<SearchedPair>> searched_;
  std::vector<Judged> judged_;  ///< until their pair is searched
  PoseGraphOptions graph_options_;
  double size_mm_ = 0.0;  ///< largest of the poses: what several of them see is larger than what one sees
};

}  // namespace scanrig
