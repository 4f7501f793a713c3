#include "pipeline/pose/pose_search.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< of a best one that is held badly, refined at full resolution

bool alike(const Transform& a, const Transform& b, const Scene& scene, double degrees, double shift) {
  return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(degrees) &&
         (a * scene.middle2 - b * scene.middle2).norm() < shift * scene.size_mm;
}

/// Confirmations fade with the distance: a ranking for motions that are still degrees off.
double soft_score(const std::vector<SampleCheck>& sample_checks, double reach_mm, double weight) {
  double sum = 0.0;
  for (const SampleCheck& t : sample_checks) {
    if (t.kind == SampleCheck::Kind::free_space) sum -= weight;
    if (t.kind == SampleCheck::Kind::surface) sum += 1.0 - std::abs(t.distance_mm) / reach_mm;
  }
  return sum / static_cast<double>(std::max<std::size_t>(sample_checks.size(), 1));
}

/// The turn that the surfaces' correspondences hold least.
FreeTurn weakest_turn(const RefinedPose& aligned) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  const double trace = aligned.information.trace();
  if (!(trace > 0.0)) return {};
  const Matrix6 covariance = (aligned.information + 1e-9 * trace * Matrix6::Identity()).inverse();
  const PrincipalSigmas turns = principal_sigmas(covariance.topLeftCorner<3, 3>());
  const Eigen::Vector3d axis = turns.directions.col(0);
  // The motion of the centre that goes with the turn says where the axis is.
  Eigen::Vector3d slide = covariance.bottomLeftCorner<3, 3>() * axis / (turns.sigma[0] * turns.sigma[0]);
  slide -= axis * axis.dot(slide);
  return {axis, aligned.centre + axis.cross(slide)};
}

/// Turn and slide that the correspondences hold least, for 1 mm at `arm_mm` from the centre.
Eigen::Matrix<double, 6, 1> loosest_motion(const RefinedPose& aligned, double arm_mm) {
  Eigen::Matrix<double, 6, 1> arc;
  arc << Eigen::Vector3d::Constant(1.0 / arm_mm), Eigen::Vector3d::Ones();
  const Eigen::Matrix<double, 6, 6> scaled = arc.asDiagonal() * aligned.information * arc.asDiagonal();
  return arc.asDiagonal() * Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(scaled).eigenvectors().col(0);
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

void narrow(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options, const SearchRound& round) {
  parallel_for(field.size(), [&](std::size_t i) {
    Hypothesis& h = field[i];
    if (round.iterations > 0) {
      RefineOptions refine;
      refine.max_iterations = round.iterations;
      h.candidate.contacts =
          contacts_for(h.candidate.pose1_from_pose2, scene.pairs, scene.solid2.properties, options.pairs);
      refine.contacts = h.candidate.contacts;
      const RefinedPose aligned = align(scene.measured1, scene.measured2, h.candidate.pose1_from_pose2, round.level,
                                        round.capture * scene.size_mm, refine);
      h.candidate.pose1_from_pose2 = aligned.pose1_from_pose2;
      h.condition = aligned.condition;
      h.weakest = weakest_turn(aligned);
      h.loosest = loosest_motion(aligned, 0.5 * scene.size_mm);
      h.centre = aligned.centre;
    }
    const double reach = round.reach * scene.size_mm;
    h.sample_checks = check_samples(scene.observations1, scene.observations2, h.candidate.pose1_from_pose2, round.level,
                                    reach, options.agreement);
    h.score = soft_score(h.sample_checks, reach, round.contradiction_weight);
  });
  std::stable_sort(field.begin(), field.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
  keep_distinct(field, scene, options, round.keep, round.apart_deg);
}

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
  vary_loosest(field, scene, options, options.rounds.back());
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
  vary_loosest(finalists, scene, options, round);
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
