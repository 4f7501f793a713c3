#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/transform.h"

/// The best consistent set of poses, from motions of pairs of them.
namespace scanrig {

/// A motion between two poses that fits these two, taken alone.
struct PairMotion {
  std::size_t pose1 = 0, pose2 = 1;  ///< the smaller number first
  Transform pose1_from_pose2 = Transform::Identity();
  double confirmed = 0.0;     ///< share of both surfaces
  bool is_certain = true;     ///< nothing else fits that pair
  bool is_symmetric = false;  ///< others fit too and give the same surface
};

/// What two poses say of a motion between them that follows from other pairs.
struct PairVerdict {
  enum class Kind {
    agrees,  ///< they fit together so
    apart,   ///< they share too little surface there to say so, and do not contradict
    contradicts
  };
  Kind kind = Kind::apart;
  double confirmed = 0.0, contradicted = 0.0;  ///< shares of both surfaces
};
const char* to_string(PairVerdict::Kind kind);

/// Called for pairs with `pose1` < `pose2`; asked once for motions that are alike.
using PairJudge = std::function<PairVerdict(std::size_t pose1, std::size_t pose2, const Transform& pose1_from_pose2)>;

struct PoseGraphOptions {
  double same_deg = 5.0;     ///< motions closer than this ...
  double same_mm = 5.0;      ///< ... and, at a point of the object, this are one
  double arm_mm = 40.0;      ///< distance of that point from the frame's origin
  double rival_share = 0.7;  ///< another answer confirms at least this share of what the best one confirms
};

/// Poses that fit together, and where they lie.
struct PoseSet {
  std::vector<std::optional<Transform>> model_from_pose;  ///< of every pose; nothing: left out. The first: identity
  std::vector<std::size_t> doubtful;  ///< left out because several places of it fit and nothing decides
  double confirmed = 0.0;             ///< sum over all pairs that agree
  bool uses_symmetry = false;         ///< a pose was placed by one of several motions that give the same surface
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t first() const;  ///< pose whose frame is the model's
  /// Both must be in the set.
  [[nodiscard]] Transform motion(std::size_t pose1, std::size_t pose2) const {
    return model_from_pose[pose1]->inverse() * *model_from_pose[pose2];
  }
};

/// Whether two motions of one pair are the same.
bool alike(const Transform& a, const Transform& b, const PoseGraphOptions& options);

/// The largest set of poses of which no two contradict each other and in which agreeing pairs join all; of those of one
/// size the one that confirms most. Sets grow from each motion in turn, pose by pose; a pose is added where it agrees
/// with most of the others. A wrong motion is so outvoted by those that agree around it.
/// Fails with `no_overlap` (no motion at all) and `ambiguous` (other sets of the same size confirm nearly as much; the
/// message names the poses, from 1).
Result<PoseSet> best_pose_set(std::size_t poses, std::span<const PairMotion> motions, const PairJudge& judge,
                              const PoseGraphOptions& options);

}  // namespace scanrig
