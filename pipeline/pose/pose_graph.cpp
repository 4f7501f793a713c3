#include "pipeline/pose/pose_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/units.h"

namespace scanrig {
namespace {

/// Asks the judge once for motions that are alike.
class JudgedPairs {
 public:
  JudgedPairs(const PairJudge& judge, const PoseGraphOptions& options) : judge_(judge), options_(options) {}

  PairVerdict of(std::size_t a, std::size_t b, const Transform& a_from_b) {
    const bool is_ordered = a < b;
    const std::size_t pose1 = std::min(a, b), pose2 = std::max(a, b);
    const Transform motion = is_ordered ? a_from_b : a_from_b.inverse();
    for (const Judged& known : known_) {
      if (known.pose1 == pose1 && known.pose2 == pose2 && alike(known.motion, motion, options_)) return known.verdict;
    }
    known_.push_back({pose1, pose2, motion, judge_(pose1, pose2, motion)});
    return known_.back().verdict;
  }
  void know(const PairMotion& m) {
    known_.push_back({m.pose1, m.pose2, m.pose1_from_pose2, {PairVerdict::Kind::agrees, m.confirmed, 0.0}});
  }

 private:
  struct Judged {
    std::size_t pose1, pose2;
    Transform motion;
    PairVerdict verdict;
  };
  const PairJudge& judge_;
  const PoseGraphOptions& options_;
  std::vector<Judged> known_;
};

/// One way to add a pose to a set.
struct Addition {
  std::size_t pose = 0;
  Transform model_from_pose = Transform::Identity();
  std::size_t agreeing = 0;  ///< poses of the set
  double confirmed = 0.0;
  bool is_symmetric = false;
  [[nodiscard]] bool is_better_than(const Addition& other) const {
    if (agreeing != other.agreeing) return agreeing > other.agreeing;
    if (is_symmetric != other.is_symmetric) return other.is_symmetric;
    return confirmed > other.confirmed;
  }
};

/// Nothing where the motion does not reach from the set to a new pose, or where a pose of the set contradicts.
std::optional<Addition> addition(const PoseSet& set, const PairMotion& motion, JudgedPairs& pairs) {
  const bool has1 = set.model_from_pose[motion.pose1].has_value(), has2 = set.model_from_pose[motion.pose2].has_value();
  if (has1 == has2) return std::nullopt;
  Addition added;
  added.is_symmetric = motion.is_symmetric;
  added.pose = has1 ? motion.pose2 : motion.pose1;
  added.model_from_pose = has1 ? *set.model_from_pose[motion.pose1] * motion.pose1_from_pose2
                               : *set.model_from_pose[motion.pose2] * motion.pose1_from_pose2.inverse();
  for (std::size_t pose = 0; pose < set.model_from_pose.size(); ++pose) {
    if (!set.model_from_pose[pose]) continue;
    const PairVerdict verdict =
        pairs.of(pose, added.pose, set.model_from_pose[pose]->inverse() * added.model_from_pose);
    if (verdict.kind == PairVerdict::Kind::contradicts) return std::nullopt;
    if (verdict.kind == PairVerdict::Kind::agrees) {
      ++added.agreeing;
      added.confirmed += verdict.confirmed;
    }
  }
  return added;
}

/// The best addition of one pose; nothing where another place of it is as good.
std::optional<Addition> undoubted(const std::vector<Addition>& additions, std::size_t pose,
                                  const PoseGraphOptions& options) {
  const Addition* best = nullptr;
  for (const Addition& a : additions) {
    if (a.pose == pose && (best == nullptr || a.is_better_than(*best))) best = &a;
  }
  if (best == nullptr) return std::nullopt;
  const bool has_rival = std::ranges::any_of(additions, [&](const Addition& a) {
    return a.pose == pose && !a.is_symmetric && a.agreeing == best->agreeing &&
           a.confirmed > options.rival_share * best->confirmed &&
           !alike(a.model_from_pose, best->model_from_pose, options);
  });
  return has_rival ? std::nullopt : std::optional(*best);
}

PoseSet grow(std::size_t poses, const PairMotion& seed, std::span<const PairMotion> motions, JudgedPairs& pairs,
             const PoseGraphOptions& options) {
  PoseSet set{.model_from_pose = std::vector<std::optional<Transform>>(poses), .doubtful = {}};
  set.model_from_pose[seed.pose1] = Transform::Identity();
  set.model_from_pose[seed.pose2] = seed.pose1_from_pose2;
  set.confirmed = seed.confirmed;
  set.uses_symmetry = seed.is_symmetric;
  while (set.size() < poses) {
    std::vector<Addition> additions;
    for (const PairMotion& motion : motions) {
      if (const auto found = addition(set, motion, pairs)) additions.push_back(*found);
    }
    std::optional<Addition> best;
    set.doubtful.clear();
    for (std::size_t pose = 0; pose < poses; ++pose) {
      const auto found = undoubted(additions, pose, options);
      if (found && (!best || found->is_better_than(*best))) best = found;
      const bool is_reached = std::ranges::find(additions, pose, &Addition::pose) != additions.end();
      if (!found && is_reached) set.doubtful.push_back(pose);
    }
    if (!best) break;
    set.model_from_pose[best->pose] = best->model_from_pose;
    set.confirmed += best->confirmed;
    set.uses_symmetry |= best->is_symmetric;
  }
  const Transform first_from_model = set.model_from_pose[set.first()]->inverse();
  for (auto& placed : set.model_from_pose) {
    if (placed) placed = first_from_model * *placed;
  }
  set.model_from_pose[set.first()] = Transform::Identity();
  return set;
}

bool holds(const PoseSet& set, const PairMotion& motion, const PoseGraphOptions& options) {
  return set.model_from_pose[motion.pose1] && set.model_from_pose[motion.pose2] &&
         alike(set.motion(motion.pose1, motion.pose2), motion.pose1_from_pose2, options);
}

std::string names(const PoseSet& set) {
  std::vector<std::string> numbers;
  for (std::size_t pose = 0; pose < set.model_from_pose.size(); ++pose) {
    if (set.model_from_pose[pose]) numbers.push_back(fmt::format("{}", pose + 1));
  }
  const std::string last = numbers.back();
  numbers.pop_back();
  return fmt::format("{} and {}", fmt::join(numbers, ", "), last);
}

struct GrownSet {
  PoseSet set;
  bool is_from_certain = false;
};

bool is_better_set(const PoseSet& a, const PoseSet& b) {
  return a.size() != b.size() ? a.size() > b.size() : a.confirmed > b.confirmed;
}

bool has_same_poses(const PoseSet& a, const PoseSet& b) {
  return std::ranges::equal(a.model_from_pose, b.model_from_pose,
                            [](const auto& x, const auto& y) { return x.has_value() == y.has_value(); });
}

/// Another set that is as good as the best of those `from_certain` motions, or of all.
const PoseSet* rival_of(const PoseSet& best, std::span<const GrownSet> sets, bool from_certain,
                        const PoseGraphOptions& options) {
  for (const GrownSet& other : sets) {
    if (&other.set == &best || (from_certain && !other.is_from_certain)) continue;
    const bool is_same = has_same_poses(best, other.set) && (best.uses_symmetry || other.set.uses_symmetry);
    if (!is_same && other.set.size() == best.size() && other.set.confirmed > options.rival_share * best.confirmed) {
      return &other.set;
    }
  }
  return nullptr;
}

}  // namespace

const char* to_string(PairVerdict::Kind kind) {
  switch (kind) {
    case PairVerdict::Kind::agrees: return "agrees";
    case PairVerdict::Kind::apart: return "apart";
    case PairVerdict::Kind::contradicts: return "contradicts";
  }
  return "";
}

std::size_t PoseSet::size() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(model_from_pose, [](const auto& placed) { return placed.has_value(); }));
}

std::size_t PoseSet::first() const {
  const auto found = std::ranges::find_if(model_from_pose, [](const auto& placed) { return placed.has_value(); });
  return static_cast<std::size_t>(found - model_from_pose.begin());
}

bool alike(const Transform& a, const Transform& b, const PoseGraphOptions& options) {
  const Eigen::Vector3d point(0.0, options.arm_mm, 0.0);
  return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(options.same_deg) &&
         (a * point - b * point).norm() < options.same_mm;
}

Result<PoseSet> best_pose_set(std::size_t poses, std::span<const PairMotion> motions, const PairJudge& judge,
                              const PoseGraphOptions& options) {
  JudgedPairs pairs(judge, options);
  std::vector<std::size_t> order(motions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    if (motions[a].is_certain != motions[b].is_certain) return motions[a].is_certain;
    return motions[a].confirmed > motions[b].confirmed;
  });
  for (const PairMotion& motion : motions) pairs.know(motion);
  std::vector<GrownSet> sets;
  for (const std::size_t seed : order) {
    const bool is_known =
        std::ranges::any_of(sets, [&](const GrownSet& grown) { return holds(grown.set, motions[seed], options); });
    if (!is_known) {
      sets.push_back({grow(poses, motions[seed], motions, pairs, options), motions[seed].is_certain});
    }
  }
  if (sets.empty()) return fail(ErrorCode::no_overlap, "pose estimation: no two poses of the scan fit together");
  std::ranges::stable_sort(sets, [](const GrownSet& a, const GrownSet& b) { return is_better_set(a.set, b.set); });
  const PoseSet* rival = rival_of(sets.front().set, sets, false, options);
  if (rival == nullptr) return sets.front().set;
  // Of what single pairs leave open nothing is chosen; what they are sure of may be enough.
  const auto certain = std::ranges::find_if(sets, &GrownSet::is_from_certain);
  if (certain != sets.end()) {
    const PoseSet* other = rival_of(certain->set, sets, true, options);
    if (other == nullptr) return certain->set;
    rival = other;
  }
  const PoseSet& best = certain != sets.end() ? certain->set : sets.front().set;
  return fail(ErrorCode::ambiguous,
              "pose estimation: poses {} fit together, and so do poses {} in another way, but not all of them; scan a "
              "pose again, or leave out one of another object",
              names(best), names(*rival));
}

}  // namespace scanrig
