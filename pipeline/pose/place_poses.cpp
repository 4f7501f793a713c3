#include "pipeline/pose/place_poses.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/pose/pair_search.h"

namespace scanrig {
namespace {

constexpr double kMinConfirmedUnsearched = 0.12;  ///< twice what a search needs
constexpr double kSurplusContradicted = 0.01;     ///< more than in the pairs that it follows from

/// The largest share of contradiction in a pair's own motion, of pairs that were searched and are in the set.
double worst_own(const PairSearch& search, const PoseSet& set) {
  double worst = 0.0;
  for (std::size_t a = 0; a < set.model_from_pose.size(); ++a) {
    for (std::size_t b = a + 1; b < set.model_from_pose.size(); ++b) {
      const SearchedPair* pair = set.model_from_pose[a] && set.model_from_pose[b] ? search.searched(a, b) : nullptr;
      if (pair != nullptr && !pair->fitting.empty()) {
        worst = std::max(worst, pair->fitting.front().agreement.contradicted_share());
      }
    }
  }
  return worst;
}

/// Whether a search of the pair could tell nothing new: both are placed, and fit as well as those that were searched.
bool follows(PairSearch& search, const PoseSet& set, std::size_t a, std::size_t b) {
  if (!set.model_from_pose[a] || !set.model_from_pose[b]) return false;
  const PairVerdict judged = search.judge(a, b, set.motion(a, b));
  if (judged.kind != PairVerdict::Kind::agrees || judged.confirmed < kMinConfirmedUnsearched) return false;
  const double share = judged.contradicted / std::max(judged.confirmed + judged.contradicted, 1e-9);
  const double allowed = worst_own(search, set) + kSurplusContradicted;
  return share <= allowed || search.contradicted_finely(a, b, set.motion(a, b)) <= allowed;
}

Result<PoseSet> best_set(PairSearch& search, std::size_t poses) {
  const PairJudge judge = [&](std::size_t a, std::size_t b, const Transform& m) { return search.judge(a, b, m); };
  const auto plain = search.motions(false), all = search.motions(true);
  auto set = best_pose_set(poses, plain, judge, search.graph_options());
  const bool is_whole = set && set->size() == poses;
  if (is_whole || all.size() == plain.size()) return set;
  auto larger = best_pose_set(poses, all, judge, search.graph_options());
  return !set || (larger && larger->size() > set->size()) ? larger : set;
}

/// Searches until every pair was searched or follows from those that were.
Result<PoseSet> search_pairs(PairSearch& search, std::size_t poses, const Context& context, int& searches) {
  const auto begin = [&](std::size_t a, std::size_t b) {
    searches += search.searched(a, b) == nullptr ? 1 : 0;
    return search.search(a, b, context);
  };
  for (std::size_t b = 1; b < poses; ++b) {
    if (auto done = begin(0, b); !done) return pass_on(done);
    context.report("pose", static_cast<double>(b) / static_cast<double>(poses));
  }
  const auto sketch = best_set(search, poses);
  for (std::size_t a = 1; a < poses; ++a) {
    for (std::size_t b = a + 1; b < poses; ++b) {
      if (sketch && follows(search, *sketch, a, b)) continue;
      if (auto done = begin(a, b); !done) return pass_on(done);
    }
  }
  return best_set(search, poses);
}

PosePair::Verdict verdict_of(const SearchedPair* pair, const PosePair& described, const PoseGraphOptions& options) {
  using Verdict = PosePair::Verdict;
  using Kind = PairVerdict::Kind;
  if (pair == nullptr) return described.pose1_from_pose2 ? Verdict::follows : Verdict::not_searched;
  const bool is_placed = described.pose1_from_pose2.has_value();
  const auto is_answer = [&](const Candidate& c) {
    return is_placed && alike(c.pose1_from_pose2, *described.pose1_from_pose2, options);
  };
  const bool is_symmetric = pair->estimate && pair->estimate->symmetry.group != Symmetry::Group::none;
  const bool agrees = std::ranges::any_of(pair->fitting, is_answer) ||
                      (is_symmetric && is_placed && described.judged.kind == Kind::agrees);
  if (agrees && turns_over(*described.pose1_from_pose2)) return Verdict::agrees;
  if (agrees) return Verdict::same_rest;
  if (pair->fitting.empty()) {
    if (!is_placed) return Verdict::no_overlap;
    return described.judged.kind == Kind::agrees ? Verdict::follows : Verdict::apart;
  }
  return pair->fitting.size() > 1 && !pair->estimate ? Verdict::ambiguous : Verdict::outvoted;
}

std::vector<PosePair> describe_pairs(PairSearch& search, const PoseSet& set) {
  std::vector<PosePair> pairs;
  for (std::size_t a = 0; a < set.model_from_pose.size(); ++a) {
    for (std::size_t b = a + 1; b < set.model_from_pose.size(); ++b) {
      PosePair& pair = pairs.emplace_back(PosePair{.pose1 = a, .pose2 = b});
      if (set.model_from_pose[a] && set.model_from_pose[b]) {
        pair.pose1_from_pose2 = set.motion(a, b);
        pair.judged = search.judge(a, b, *pair.pose1_from_pose2);
      }
      const SearchedPair* searched = search.searched(a, b);
      pair.verdict = verdict_of(searched, pair, search.graph_options());
      if (searched == nullptr) continue;
      if (searched->estimate) {
        pair.estimate = *searched->estimate;
      } else {
        pair.message = searched->estimate.error().message;
      }
    }
  }
  return pairs;
}

LeftOutPose left_out(std::size_t pose, const PlacedPoses& placed, const PoseSet& set) {
  const auto fits_somewhere = [&](const PosePair& pair) {
    return (pair.pose1 == pose || pair.pose2 == pose) && pair.verdict == PosePair::Verdict::outvoted;
  };
  const char* why = "it fits none of the others. Check that it is the same object and that it shares surface with them";
  if (std::ranges::any_of(placed.pairs, fits_somewhere)) {
    why = "it fits some of the others alone, but not all that fit together";
  }
  if (std::ranges::find(set.doubtful, pose) != set.doubtful.end()) {
    why = "it fits the others in several ways, and nothing decides between them";
  }
  return {pose, fmt::format("Pose {} is not used: {}.", pose + 1, why)};
}

}  // namespace

const char* to_string(PosePair::Verdict verdict) {
  switch (verdict) {
    case PosePair::Verdict::agrees: return "agrees";
    case PosePair::Verdict::follows: return "follows";
    case PosePair::Verdict::apart: return "apart";
    case PosePair::Verdict::outvoted: return "outvoted";
    case PosePair::Verdict::no_overlap: return "no overlap";
    case PosePair::Verdict::same_rest: return "same rest";
    case PosePair::Verdict::ambiguous: return "ambiguous";
    case PosePair::Verdict::not_searched: return "not searched";
  }
  return "";
}

Result<PlacedPoses> place_poses(std::span<const PoseInput> poses, const PoseOptions& options, const Context& context) {
  if (poses.size() < 2 || poses.size() > kMaxPoses) {
    return fail(ErrorCode::invalid_input, "pose estimation: 2 to {} poses can be placed, not {}", kMaxPoses,
                poses.size());
  }
  PairSearch search(poses, options);
  PlacedPoses placed;
  const auto set = search_pairs(search, poses.size(), context, placed.searches);
  if (!set) return pass_on(set);
  placed.model_from_pose = set->model_from_pose;
  placed.pairs = describe_pairs(search, *set);
  const auto turns = [](const PosePair& pair) { return pair.pose1_from_pose2 && turns_over(*pair.pose1_from_pose2); };
  if (std::ranges::none_of(placed.pairs, turns)) {
    return fail(
        ErrorCode::same_rest,
        "pose estimation: the object was not turned over between the poses that fit together; lay it on another "
        "side and scan it again");
  }
  for (std::size_t pose = 0; pose < poses.size(); ++pose) {
    if (!set->model_from_pose[pose]) placed.left_out.push_back(left_out(pose, placed, *set));
  }
  return placed;
}

}  // namespace scanrig
