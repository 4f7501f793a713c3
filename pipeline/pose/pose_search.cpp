#include "pipeline/pose/pose_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig {
namespace {

constexpr double kCleanShare = 0.5;     ///< of what the best one confirms, that one that contradicts little must
constexpr std::size_t kNeighbours = 2;  ///< of a best one that is held badly, refined at full resolution

bool alike(const Transform& a, const Transform& b, const Scene& scene, double degrees, double shift) {
  return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(degrees) &&
         (a * scene.middle2 - b * scene.middle2).norm() < shift * scene.size_mm;
}

/// Patches that contradict `second` and not `first`.
std::size_t patches_against(const std::vector<double>& second, const std::vector<double>& first, double limit) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < first.size(); ++i) count += second[i] > limit && first[i] < 0.5 * limit ? 1 : 0;
  return count;
}

/// What is too small to contradict single samples: a low bump. The best is the one that no patch speaks against.
void separate_by_patches(std::vector<Hypothesis>& finalists, const Scene& scene, const PoseOptions& options) {
  const PatchOptions& limits = options.symmetry.patches;
  const Patches patches =
      make_patches(scene.measured1, scene.measured2, options.last_round.level, limits.cell * scene.size_mm);
  const double spread = 1.4826 * finalists[0].candidate.agreement.median_mm;
  const double of_patches = patch_spread(patches, finalists[0].sample_checks, limits);
  std::vector<std::vector<double>> misfits;
  for (const Hypothesis& h : finalists) {
    misfits.push_back(patch_misfits(patches, h.sample_checks, spread, of_patches, options.agreement, limits));
  }
  const auto is_worse = [&](std::size_t a, std::size_t b) {
    const std::size_t against_a = patches_against(misfits[a], misfits[b], limits.limit);
    const std::size_t against_b = patches_against(misfits[b], misfits[a], limits.limit);
    return against_a >= options.symmetry.min_misfits && against_a > 3 * against_b;
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < finalists.size(); ++i) {
    if (is_worse(best, i) && !finalists[i].candidate.separable) best = i;
  }
  for (std::size_t i = 0; i < finalists.size(); ++i) {
    if (i != best && is_worse(i, best)) finalists[i].candidate.separable = true;
  }
  if (best == 0) return;
  std::rotate(finalists.begin(), finalists.begin() + static_cast<std::ptrdiff_t>(best),
              finalists.begin() + static_cast<std::ptrdiff_t>(best) + 1);
  for (Hypothesis& h : finalists) h.candidate.angle_to_best_deg = apart_deg(h.candidate, finalists[0].candidate);
}

/// Where the best one contradicts more than a right one does, those that do not come before it, unless they confirm
/// far less: a wrong motion may confirm more than its contradictions are counted for.
void clean_first(std::vector<Hypothesis>& field, const PoseOptions& options) {
  if (field.empty()) return;
  const double enough = std::max(options.min_overlap, kCleanShare * field[0].candidate.agreement.confirmed);
  const auto is_clean = [&](const Hypothesis& h) {
    const Agreement& agreement = h.candidate.agreement;
    return agreement.contradicted_share() <= options.search_again_contradicted && agreement.confirmed >= enough;
  };
  if (is_clean(field[0])) return;
  std::stable_partition(field.begin(), field.end(), is_clean);
}

/// The best, its rivals, and where the surface holds it badly the next best ones beside it: on a coarser level a wrong
/// turn may contradict as little as the right one. `others`: what is left.
std::vector<Hypothesis> take_finalists(std::vector<Hypothesis>& field, const PoseOptions& options,
                                       std::vector<Hypothesis>& others) {
  const Candidate best = field[0].candidate;
  std::size_t neighbours = field[0].condition > options.weak_condition ? kNeighbours : 0;
  std::vector<Hypothesis> finalists;
  for (Hypothesis& h : field) {
    bool is_finalist = finalists.empty() || is_rival(h.candidate, best, options);
    if (!is_finalist && neighbours > 0 && h.candidate.angle_to_best_deg <= options.same_deg && !h.candidate.separable) {
      is_finalist = true;
      --neighbours;
    }
    (is_finalist ? finalists : others).push_back(std::move(h));
  }
  return finalists;
}

}  // namespace

void keep_distinct(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options, std::size_t count,
                   double apart_deg) {
  std::vector<Hypothesis> kept;
  for (Hypothesis& h : field) {
    if (kept.size() == count) break;
    const bool is_known = std::ranges::any_of(kept, [&](const Hypothesis& k) {
      return alike(k.candidate.pose1_from_pose2, h.candidate.pose1_from_pose2, scene, apart_deg, options.same_shift);
    });
    if (!is_known) kept.push_back(std::move(h));
  }
  field = std::move(kept);
}

void judge(std::vector<Hypothesis>& field, const PoseOptions& options) {
  double spread = std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : field) {
    const Agreement loose =
        count_agreement(h.sample_checks, std::numeric_limits<double>::infinity(), options.agreement);
    if (loose.confirmed > options.min_overlap) spread = std::min(spread, 1.4826 * loose.median_mm);
  }
  for (Hypothesis& h : field) h.candidate.agreement = count_agreement(h.sample_checks, spread, options.agreement);
  const double weight = options.last_round.contradiction_weight;
  std::stable_sort(field.begin(), field.end(), [weight](const Hypothesis& a, const Hypothesis& b) {
    return a.candidate.agreement.score(weight) > b.candidate.agreement.score(weight);
  });
  clean_first(field, options);
  for (Hypothesis& h : field) {
    const AgreementGap with_best = compare(field[0].sample_checks, h.sample_checks, spread, options.agreement);
    Candidate& c = h.candidate;
    c.contradicted_more = with_best.contradicted_more;
    c.separable = with_best.separable;
    c.angle_to_best_deg = apart_deg(c, field[0].candidate);
  }
}

void settle(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options) {
  if (field.empty()) return;
  judge(field, options);
  vary_weakest(field, scene, options, options.rounds.back());
  judge(field, options);
  std::vector<Hypothesis> others;
  std::vector<Hypothesis> finalists = take_finalists(field, options, others);
  if (finalists.size() < 2 &&
      finalists[0].candidate.agreement.contradicted_share() <= options.search_again_contradicted &&
      fits(finalists[0].candidate.agreement, scene.size_mm, options)) {
    field = std::move(finalists);
    field.insert(field.end(), std::make_move_iterator(others.begin()), std::make_move_iterator(others.end()));
    return;
  }
  SearchRound round = options.last_round;
  round.keep = finalists.size();
  narrow(finalists, scene, options, round);
  vary_weakest(finalists, scene, options, round);
  judge(finalists, options);
  keep_distinct(finalists, scene, options, finalists.size(), options.same_deg);
  separate_by_patches(finalists, scene, options);
  field = std::move(finalists);
  field.insert(field.end(), std::make_move_iterator(others.begin()), std::make_move_iterator(others.end()));
}

double apart_deg(const Candidate& a, const Candidate& b) {
  return to_degrees(rotation_angle(b.pose1_from_pose2.linear().transpose() * a.pose1_from_pose2.linear()));
}

double tilt_deg(const Transform& pose1_from_pose2) {
  const Eigen::Vector3d up = pose1_from_pose2.linear().col(1);
  return to_degrees(std::atan2(std::hypot(up.x(), up.z()), up.y()));
}

bool is_rival(const Candidate& c, const Candidate& best, const PoseOptions& options) {
  return c.angle_to_best_deg > options.same_deg && !c.separable &&
         c.agreement.confirmed > options.rival_share * best.agreement.confirmed;
}

std::vector<const Candidate*> rivals_of(const std::vector<Hypothesis>& field, const PoseOptions& options) {
  std::vector<const Candidate*> rivals;
  for (const Hypothesis& h : field) {
    if (is_rival(h.candidate, field[0].candidate, options)) rivals.push_back(&h.candidate);
  }
  return rivals;
}

bool turns_over(const Transform& pose1_from_pose2, const PoseOptions& options) {
  return tilt_deg(pose1_from_pose2) >= options.same_rest_tilt_deg;
}

}  // namespace scanrig
