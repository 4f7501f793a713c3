#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/max_poses.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/pose_graph.h"

/// Where the poses of a scan lie in one another.
namespace scanrig {

/// Two poses and what became of their own motion.
struct PosePair {
  enum class Verdict {
    agrees,       ///< their own motion is that of the answer
    follows,      ///< not searched: they confirm the motion that follows from other pairs
    apart,        ///< the answer puts them where they share too little surface, and nothing contradicts
    outvoted,     ///< their own motion is not that of the answer
    no_overlap,   ///< they fit nowhere
    same_rest,    ///< as `agrees`, but the object was only turned on the table between them
    ambiguous,    ///< several motions fit, and the answer has none of them
    not_searched  ///< one of them is left out
  };
  std::size_t pose1 = 0, pose2 = 1;
  Verdict verdict = Verdict::not_searched;
  std::optional<PoseEstimate> estimate{};       ///< of their own motion, where the pair alone decides it
  std::optional<Transform> pose1_from_pose2{};  ///< of the answer, before the refinement
  PairVerdict judged{};                         ///< of that
  std::string message{};                        ///< of the search that found no answer
};
const char* to_string(PosePair::Verdict verdict);

struct LeftOutPose {
  std::size_t pose = 0;
  std::string sentence;  ///< for the operator; poses from 1
};

struct PlacedPoses {
  std::vector<std::optional<Transform>> model_from_pose;  ///< of every pose; nothing: left out. The first: identity
  std::vector<PosePair> pairs;                            ///< all
  std::vector<LeftOutPose> left_out;
  int searches = 0;
};

/// Places three poses or more in the frame of the first that is kept. Pairs are estimated by estimate_pose(), those
/// with the first pose before the others, and pose_graph.h keeps what fits together. A pair that confirms what follows
/// from others as clearly as they do themselves is not searched; every other pair is. So a pose is placed by one search
/// where all is clear, and by all of its pairs where anything is not. Same bits for any number of threads. Fails with
/// `invalid_input` (number of poses), `no_overlap` (no two poses fit together), `ambiguous` (sets of poses that exclude
/// each other), `same_rest` (no two of the poses that fit differ by more than a turn on the table), `stopped`.
Result<PlacedPoses> place_poses(std::span<const PoseInput> poses, const PoseOptions& options, const Context& context);

}  // namespace scanrig
