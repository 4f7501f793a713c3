#include "pipeline/pose/view_graph.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <optional>

namespace scanrig {
namespace {

/// Views that are joined so far, and where.
class Forest {
 public:
  Forest(std::size_t views, const PairJudge& judge, const PoseGraphOptions& options)
      : judge_(judge),
        options_(options),
        set_(views),
        members_(views),
        set_from_view_(views, Transform::Identity()),
        confirmed_(views, 0.0) {
    std::iota(set_.begin(), set_.end(), 0U);
    for (std::size_t v = 0; v < views; ++v) members_[v] = {v};
  }

  [[nodiscard]] bool joins(const PairMotion& motion) const { return set_[motion.pose1] != set_[motion.pose2]; }
  [[nodiscard]] bool joins_same_sets(const PairMotion& a, const PairMotion& b) const {
    const std::size_t a1 = set_[a.pose1], a2 = set_[a.pose2], b1 = set_[b.pose1], b2 = set_[b.pose2];
    return (a1 == b1 && a2 == b2) || (a1 == b2 && a2 == b1);
  }
  /// The motion of the second's set in the first's, the set of the lower number first.
  [[nodiscard]] Transform set1_from_set2(const PairMotion& motion) const {
    const Transform between =
        set_from_view_[motion.pose1] * motion.pose1_from_pose2 * set_from_view_[motion.pose2].inverse();
    return set_[motion.pose1] < set_[motion.pose2] ? between : between.inverse();
  }
  /// What all views of both sets confirm of the motion; nothing where any two contradict.
  [[nodiscard]] std::optional<double> support(const PairMotion& motion) const {
    const std::size_t set1 = std::min(set_[motion.pose1], set_[motion.pose2]);
    const std::size_t set2 = std::max(set_[motion.pose1], set_[motion.pose2]);
    const Transform between = set1_from_set2(motion);
    double confirmed = motion.confirmed;
    for (const std::size_t a : members_[set1]) {
      for (const std::size_t b : members_[set2]) {
        if (std::min(a, b) == motion.pose1 && std::max(a, b) == motion.pose2) continue;
        const Transform a_from_b = set_from_view_[a].inverse() * between * set_from_view_[b];
        const PairVerdict verdict = a < b ? judge_(a, b, a_from_b) : judge_(b, a, a_from_b.inverse());
        if (verdict.kind == PairVerdict::Kind::contradicts) return std::nullopt;
        if (verdict.kind == PairVerdict::Kind::agrees) confirmed += verdict.confirmed;
      }
    }
    return confirmed;
  }
  void join(const PairMotion& motion) {
    const std::size_t set1 = std::min(set_[motion.pose1], set_[motion.pose2]);
    const std::size_t set2 = std::max(set_[motion.pose1], set_[motion.pose2]);
    const Transform between = set1_from_set2(motion);
    for (const std::size_t v : members_[set2]) {
      set_[v] = set1;
      set_from_view_[v] = between * set_from_view_[v];
      members_[set1].push_back(v);
    }
    members_[set2].clear();
    confirmed_[set1] += confirmed_[set2] + motion.confirmed;
    tree_.push_back({motion.pose1, motion.pose2});
  }
  /// Another motion that would join the same sets in another way, and that the views confirm nearly as much.
  [[nodiscard]] bool has_rival(const PairMotion& motion, double confirmed, std::span<const PairMotion> motions) const {
    const Transform between = set1_from_set2(motion);
    return std::ranges::any_of(motions, [&](const PairMotion& other) {
      if (other.confirmed < options_.rival_share * motion.confirmed || !joins(other)) return false;
      if (!joins_same_sets(motion, other) || alike(set1_from_set2(other), between, options_)) return false;
      return support(other).value_or(0.0) >= options_.rival_share * confirmed;
    });
  }
  [[nodiscard]] std::vector<ViewSet> sets() const {
    std::vector<ViewSet> sets;
    for (std::size_t s = 0; s < members_.size(); ++s) {
      if (members_[s].size() < 2) continue;
      ViewSet& set = sets.emplace_back(ViewSet{.views = members_[s], .confirmed = confirmed_[s]});
      std::ranges::sort(set.views);
      std::ranges::copy_if(tree_, std::back_inserter(set.tree),
                           [&](const auto& pair) { return set_[pair.first] == s; });
      for (const std::size_t v : set.views) {
        set.model_from_view.push_back(set_from_view_[set.views.front()].inverse() * set_from_view_[v]);
      }
    }
    std::ranges::stable_sort(sets, [](const ViewSet& a, const ViewSet& b) {
      return a.views.size() != b.views.size() ? a.views.size() > b.views.size() : a.confirmed > b.confirmed;
    });
    return sets;
  }

 private:
  const PairJudge& judge_;
  const PoseGraphOptions& options_;
  std::vector<std::size_t> set_;  ///< of each view: the lowest of its set
  std::vector<std::vector<std::size_t>> members_;
  std::vector<Transform> set_from_view_;
  std::vector<double> confirmed_;
  std::vector<std::pair<std::size_t, std::size_t>> tree_;
};

}  // namespace

std::vector<ViewSet> join_views(std::size_t views, std::span<const PairMotion> motions, const PairJudge& judge,
                                const PoseGraphOptions& options) {
  Forest forest(views, judge, options);
  std::vector<bool> is_open(motions.size(), true);  // a contradiction stays one in larger sets; a rival may not
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (std::size_t m = 0; m < motions.size(); ++m) {
      if (!is_open[m] || !forest.joins(motions[m])) continue;
      const auto confirmed = forest.support(motions[m]);
      is_open[m] = confirmed.has_value();
      if (!confirmed || forest.has_rival(motions[m], *confirmed, motions)) continue;
      forest.join(motions[m]);
      has_grown = true;
    }
  }
  return forest.sets();
}

}  // namespace scanrig
