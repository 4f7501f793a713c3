#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/transform.h"
#include "pipeline/pose/pose_search.h"

namespace scanrig {
namespace {

constexpr std::size_t kVariedFinely = 6;  ///< best badly held hypotheses that are moved along what is held least
constexpr std::array kFineSteps = {0.05, 0.035, 0.02, 0.012, 0.006, 0.003, 0.0015};  ///< shares of the object's size
constexpr double kGain = 0.002;                                                      ///< of the score; less is chance

/// Along what is held least, by so many millimetres at the object's outside.
Transform moved(const Hypothesis& from, double distance_mm) {
  const Eigen::Translation3d to_centre(from.centre);
  return to_centre *
         small_motion(distance_mm * from.weakest_motion.head<3>(), distance_mm * from.weakest_motion.tail<3>()) *
         to_centre.inverse() * from.candidate.pose1_from_pose2;
}

/// Moves it to where it is contradicted least, from far to near. What it confirms beyond what it did is no gain: poses
/// that both lost the foot of upright sides would be moved apart until their sides cover one another.
void vary(Hypothesis& h, const Scene& scene, const PoseOptions& options, const SearchRound& judged) {
  const double reach = judged.reach * scene.size_mm;
  double spread = std::numeric_limits<double>::infinity(), confirmed = 1.0;
  const auto score_at = [&](double distance_mm) {
    const auto checks = check_samples(scene.observations1, scene.observations2, moved(h, distance_mm), judged.level,
                                      reach, options.agreement);
    const bool is_first = std::isinf(spread);
    if (is_first) spread = 1.4826 * count_agreement(checks, spread, options.agreement).median_mm;
    Agreement agreement = count_agreement(checks, spread, options.agreement);
    if (is_first) confirmed = agreement.confirmed;
    agreement.confirmed = std::min(agreement.confirmed, confirmed);
    return agreement.score(options.last_round.contradiction_weight);
  };
  const double start = score_at(0.0);
  double best = start, best_mm = 0.0;
  for (const double step : kFineSteps) {
    if (step > judged.capture) continue;
    const double from_mm = best_mm;
    for (const double distance_mm : {from_mm - step * scene.size_mm, from_mm + step * scene.size_mm}) {
      const double score = score_at(distance_mm);
      if (score <= best) continue;
      best = score;
      best_mm = distance_mm;
    }
  }
  if (best < start + kGain) return;
  h.candidate.pose1_from_pose2 = moved(h, best_mm);
  h.sample_checks = check_samples(scene.observations1, scene.observations2, h.candidate.pose1_from_pose2, judged.level,
                                  reach, options.agreement);
}

}  // namespace

void vary_weakest(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options,
                  const SearchRound& judged) {
  std::vector<Hypothesis*> held_badly;
  for (Hypothesis& h : field) {
    if (h.condition > options.weak_condition && held_badly.size() < kVariedFinely) held_badly.push_back(&h);
  }
  parallel_for(held_badly.size(), [&](std::size_t i) { vary(*held_badly[i], scene, options, judged); });
}

}  // namespace scanrig
