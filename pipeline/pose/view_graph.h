#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "pipeline/pose/pose_graph.h"

/// The consistent model graph of many views in unknown positions.
namespace scanrig {

/// Views that belong together.
struct ViewSet {
  std::vector<std::size_t> views{};                         ///< ascending
  std::vector<Transform> model_from_view{};                 ///< of each of `views`; the first: identity
  std::vector<std::pair<std::size_t, std::size_t>> tree{};  ///< views whose own motions joined it, the smaller first
  double confirmed = 0.0;                                   ///< sum over these motions
};

/// Joins views to sets, and sets to larger ones, by the best motions first: a spanning tree of maximum agreement
/// [Kruskal 1956; Huber and Hebert 2003, 5]. A motion joins two sets if no two views, one of each, contradict where it
/// puts them; so every loop of the graph is closed by observation. Motions that contradict are left out.
/// Unlike best_pose_set() for a few poses, the work grows with the number of motions, not with that of sets.
/// A motion that has a rival joins nothing: another one would join the same sets in another way, and what its own two
/// views, and all views, confirm of it is at least `options.rival_share` of what they confirm of the motion. `motions`:
/// best first. Returns sets of two views and more, the largest first; of one size, the one that confirms most.
std::vector<ViewSet> join_views(std::size_t views, std::span<const PairMotion> motions, const PairJudge& judge,
                                const PoseGraphOptions& options);

}  // namespace scanrig
