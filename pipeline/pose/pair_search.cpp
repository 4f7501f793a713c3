#include "pipeline/pose/pair_search.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr std::size_t kMaxMotionsPerPair = 6;   ///< that fit; more decide nothing
constexpr double kMaxContradictedApart = 0.25;  ///< of what is confirmed, where nothing could be aligned

/// The judging round of the search.
const SearchRound& verdict_round(const PoseOptions& options) { return options.rounds.back(); }

}  // namespace

PairSearch::PairSearch(std::span<const PoseInput> poses, const PoseOptions& options)
    : poses_(poses), options_(options), measured_(poses.size()), searched_(poses.size() * poses.size()) {
  parallel_for(poses.size(), [&](std::size_t i) { measured_[i] = measured_pose(poses_[i].views, options_.levels); });
  for (const MeasuredPose& pose : measured_) size_mm_ = std::max(size_mm_, pose.size_mm);
  graph_options_ = {.same_deg = 0.5 * options.same_deg,
                    .same_mm = options.same_shift * size_mm_,
                    .arm_mm = 0.4 * size_mm_,
                    .rival_share = options.rival_share};
}

Result<void> PairSearch::search(std::size_t pose1, std::size_t pose2, const Context& context) {
  auto& slot = searched_[index(pose1, pose2)];
  if (slot) return {};
  const PoseInput first{poses_[pose1].solid, poses_[pose1].views, &measured_[pose1]};
  const PoseInput second{poses_[pose2].solid, poses_[pose2].views, &measured_[pose2]};
  std::vector<Candidate> fitting;
  auto estimate = estimate_pose(first, second, options_, context, fitting);
  if (!estimate && estimate.error().code == ErrorCode::stopped) return pass_on(estimate);
  slot.emplace(SearchedPair{std::move(estimate), std::move(fitting)});
  std::erase_if(judged_, [&](const Judged& j) { return j.pair == index(pose1, pose2); });
  return {};
}

const SearchedPair* PairSearch::searched(std::size_t pose1, std::size_t pose2) const {
  const auto& slot = searched_[index(pose1, pose2)];
  return slot ? &*slot : nullptr;
}

std::vector<PairMotion> PairSearch::motions(bool with_symmetric) const {
  std::vector<PairMotion> all;
  for (std::size_t pose1 = 0; pose1 < poses_.size(); ++pose1) {
    for (std::size_t pose2 = pose1 + 1; pose2 < poses_.size(); ++pose2) {
      const SearchedPair* pair = searched(pose1, pose2);
      if (pair == nullptr || pair->fitting.empty()) continue;
      if (pair->estimate) {
        const PoseEstimate& e = *pair->estimate;
        const bool is_symmetric = e.symmetry.group != Symmetry::Group::none;
        const std::size_t count = with_symmetric && !e.symmetry.is_continuous() ? e.symmetry.elements.size() : 1;
        for (std::size_t i = 0; i < count; ++i) {
          all.push_back({pose1, pose2, e.symmetry.elements[i] * e.pose1_from_pose2, e.overlap, true, is_symmetric});
        }
        continue;
      }
      const bool is_certain = pair->fitting.size() == 1;  // a pose that was only turned on the table
      for (std::size_t i = 0; i < std::min(pair->fitting.size(), kMaxMotionsPerPair); ++i) {
        const Candidate& c = pair->fitting[i];
        all.push_back({pose1, pose2, c.pose1_from_pose2, c.agreement.confirmed, is_certain, false});
      }
    }
  }
  return all;
}

Transform PairSearch::aligned(std::size_t pose1, std::size_t pose2, const Transform& motion,
                              const SearchRound& round) const {
  RefineOptions refine;
  refine.max_iterations = round.iterations;
  return align(measured_[pose1], measured_[pose2], motion, round.level, round.capture * size_mm_, refine)
      .pose1_from_pose2;
}

PairSearch::Checked PairSearch::check(std::size_t pose1, std::size_t pose2, const Transform& motion,
                                      const SearchRound& round) const {
  const PoseObservations first{&measured_[pose1], poses_[pose1].views};
  const PoseObservations second{&measured_[pose2], poses_[pose2].views};
  Checked result;
  result.checks = check_samples(first, second, motion, round.level, round.reach * size_mm_, options_.agreement);
  result.median_mm =
      count_agreement(result.checks, std::numeric_limits<double>::infinity(), options_.agreement).median_mm;
  return result;
}

/// Whether the pair's own motion fits better than this by more than chance.
bool PairSearch::is_told_apart(const SearchedPair& pair, std::size_t pose1, std::size_t pose2,
                               const Checked& checked) const {
  for (const Candidate& own : pair.fitting) {
    const Checked best = check(pose1, pose2, own.pose1_from_pose2, verdict_round(options_));
    const double spread = 1.4826 * std::min(best.median_mm, checked.median_mm);
    if (!compare(best.checks, checked.checks, spread, options_.agreement).separable) return false;
  }
  return !pair.fitting.empty();
}

PairVerdict PairSearch::judge(std::size_t pose1, std::size_t pose2, const Transform& pose1_from_pose2) {
  const std::size_t pair = index(pose1, pose2);
  for (const Judged& known : judged_) {
    if (known.pair == pair && alike(known.motion, pose1_from_pose2, graph_options_)) return known.verdict;
  }
  return judged_.emplace_back(Judged{pair, pose1_from_pose2, judge_anew(pose1, pose2, pose1_from_pose2)}).verdict;
}

double PairSearch::contradicted_finely(std::size_t pose1, std::size_t pose2, const Transform& pose1_from_pose2) const {
  const Transform near = aligned(pose1, pose2, pose1_from_pose2, options_.last_round);
  const Checked checked = check(pose1, pose2, near, options_.last_round);
  return count_agreement(checked.checks, 1.4826 * checked.median_mm, options_.agreement).contradicted_share();
}

PairVerdict PairSearch::judge_anew(std::size_t pose1, std::size_t pose2, const Transform& pose1_from_pose2) const {
  using Kind = PairVerdict::Kind;
  const auto verdict = [&](Kind kind, const Agreement& a) { return PairVerdict{kind, a.confirmed, a.contradicted}; };
  const SearchedPair* pair = searched(pose1, pose2);
  for (const Candidate& own : pair != nullptr ? std::span(pair->fitting) : std::span<const Candidate>()) {
    if (alike(own.pose1_from_pose2, pose1_from_pose2, graph_options_)) return verdict(Kind::agrees, own.agreement);
  }
  const Transform near = aligned(pose1, pose2, pose1_from_pose2, verdict_round(options_));
  if (alike(near, pose1_from_pose2, graph_options_)) {
    const Checked checked = check(pose1, pose2, near, verdict_round(options_));
    const Agreement agreement = count_agreement(checked.checks, 1.4826 * checked.median_mm, options_.agreement);
    if (fits(agreement, size_mm_, options_)) {
      const bool is_other = pair != nullptr && is_told_apart(*pair, pose1, pose2, checked);
      return verdict(is_other ? Kind::contradicts : Kind::agrees, agreement);
    }
  }
  // Nothing to align by: where they stand as the other pairs say.
  const Checked checked = check(pose1, pose2, pose1_from_pose2, verdict_round(options_));
  const double spread = checked.median_mm > 0.0 ? 1.4826 * checked.median_mm : 0.0;
  const Agreement agreement = count_agreement(checked.checks, spread, options_.agreement);
  const double allowed = kMaxContradictedApart * std::max(agreement.confirmed, options_.min_overlap);
  return verdict(agreement.contradicted <= allowed ? Kind::apart : Kind::contradicts, agreement);
}

}  // namespace scanrig
