#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "pipeline/pose/pose_search.h"
#include "pipeline/registration/pose_uncertainty.h"

namespace scanrig {
namespace {

constexpr int kByAllBelow = 2;      ///< levels on which a motion is also aligned by all correspondences
constexpr double kMuchLess = 0.5;   ///< of what contradicts: more correspondences then tell the truth
constexpr double kElsewhere = 0.2;  ///< of what was judged, contradicted: a motion that is held well is wrong

/// Confirmations fade with the distance: a ranking for motions that are still degrees off.
double soft_score(const std::vector<SampleCheck>& sample_checks, double reach_mm, double weight) {
  double sum = 0.0;
  for (const SampleCheck& t : sample_checks) {
    if (t.kind == SampleCheck::Kind::free_space) sum -= weight;
    if (t.kind == SampleCheck::Kind::surface) sum += 1.0 - std::abs(t.distance_mm) / reach_mm;
  }
  return sum / static_cast<double>(std::max<std::size_t>(sample_checks.size(), 1));
}

/// Turn and slide that the correspondences hold least, for 1 mm at `arm_mm` from the centre.
Eigen::Matrix<double, 6, 1> weakest_motion_of(const RefinedPose& aligned, double arm_mm) {
  Eigen::Matrix<double, 6, 1> arc;
  arc << Eigen::Vector3d::Constant(1.0 / arm_mm), Eigen::Vector3d::Ones();
  const Eigen::Matrix<double, 6, 6> scaled = arc.asDiagonal() * aligned.information * arc.asDiagonal();
  return arc.asDiagonal() * Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(scaled).eigenvectors().col(0);
}

void check(Hypothesis& h, const Scene& scene, const PoseOptions& options, const SearchRound& round) {
  h.sample_checks = check_samples(scene.observations1, scene.observations2, h.candidate.pose1_from_pose2, round.level,
                                  round.reach * scene.size_mm, options.agreement);
}

/// A motion that comes to lie on a table is aligned again with that contact: of a box that was turned upside down the
/// edges, which are measured worst, would hold the height. Leaves the contacts used in `refine`.
RefinedPose align_with_contacts(const Hypothesis& start, const Scene& scene, const PoseOptions& options,
                                const SearchRound& round, RefineOptions& refine) {
  const auto contacts_at = [&](const Transform& motion) {
    return contacts_for(motion, scene.pairs, scene.solid2.properties, options.pairs);
  };
  const auto align_from = [&](const Transform& motion) {
    return align(scene.measured1, scene.measured2, motion, round.level, round.capture * scene.size_mm, refine);
  };
  refine.contacts = contacts_at(start.candidate.pose1_from_pose2);
  const RefinedPose fit = align_from(start.candidate.pose1_from_pose2);
  if (!refine.contacts.empty()) return fit;
  refine.contacts = contacts_at(fit.pose1_from_pose2);
  return refine.contacts.empty() ? fit : align_from(fit.pose1_from_pose2);
}

/// With the checks of where it comes to lie.
Hypothesis aligned(const Hypothesis& start, const Scene& scene, const PoseOptions& options, const SearchRound& round,
                   RefineOptions refine) {
  Hypothesis h = start;
  refine.max_iterations = round.iterations;
  refine.wants_covariance = false;
  const RefinedPose fit = align_with_contacts(start, scene, options, round, refine);
  h.candidate.contacts = std::move(refine.contacts);
  h.candidate.pose1_from_pose2 = fit.pose1_from_pose2;
  h.condition = fit.condition;
  h.weakest_turn = weakest_turn_of(fit);
  h.weakest_motion = weakest_motion_of(fit, 0.5 * scene.size_mm);
  h.centre = fit.centre;
  check(h, scene, options, round);
  return h;
}

/// Whether the second motion, by all correspondences, is the better one.
bool is_better_by_all(const Hypothesis& by_closest, const Hypothesis& by_all, const PoseOptions& options) {
  const auto judged = [&](const Hypothesis& h, double spread) {
    return count_agreement(h.sample_checks, spread, options.agreement);
  };
  double spread = std::numeric_limits<double>::infinity();
  for (const Hypothesis* h : {&by_closest, &by_all}) {
    spread = std::fmin(spread, 1.4826 * judged(*h, std::numeric_limits<double>::infinity()).median_mm);
  }
  return judged(by_all, spread).contradicted_share() < kMuchLess * judged(by_closest, spread).contradicted_share();
}

/// Whether what is trimmed may hold the motion: it contradicts, but not as one that is elsewhere.
bool may_be_trimmed_wrongly(const Hypothesis& by_closest, const PoseOptions& options) {
  const Agreement loose =
      count_agreement(by_closest.sample_checks, std::numeric_limits<double>::infinity(), options.agreement);
  const Agreement judged = count_agreement(by_closest.sample_checks, 1.4826 * loose.median_mm, options.agreement);
  const double share = judged.contradicted_share();
  return share > options.search_again_contradicted &&
         (share < kElsewhere || by_closest.condition > options.weak_condition);
}

/// By the closest correspondences; on fine levels, begun beside the right motion, also by all: of a mug, rim and
/// handle, which alone hold a slide along its axis, would be trimmed away.
Hypothesis aligned_both_ways(const Hypothesis& start, const Scene& scene, const PoseOptions& options,
                             const SearchRound& round) {
  Hypothesis by_closest = aligned(start, scene, options, round, {});
  if (round.level >= kByAllBelow || !may_be_trimmed_wrongly(by_closest, options)) return by_closest;
  const Hypothesis by_all = aligned(by_closest, scene, options, round, after_search());
  if (!is_better_by_all(by_closest, by_all, options)) return by_closest;
  SearchRound as_it_is = round;
  as_it_is.iterations = 0;
  return aligned(by_all, scene, options, as_it_is, {});  // how well it is held, the closest say there
}

}  // namespace

FreeTurn weakest_turn_of(const RefinedPose& aligned) {
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

void narrow(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options, const SearchRound& round) {
  parallel_for(field.size(), [&](std::size_t i) {
    Hypothesis& h = field[i];
    if (round.iterations > 0) {
      h = aligned_both_ways(h, scene, options, round);
    } else {
      check(h, scene, options, round);
    }
    h.score = soft_score(h.sample_checks, round.reach * scene.size_mm, round.contradiction_weight);
  });
  std::stable_sort(field.begin(), field.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
  keep_distinct(field, scene, options, round.keep, round.apart_deg);
}

}  // namespace scanrig
