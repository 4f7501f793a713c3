#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "core/units.h"
#include "pipeline/pose/pose_search.h"

namespace scanrig {
namespace {

constexpr double kTurnStepDeg = 5.0;  ///< of the turns about the axis that the shared surface holds least
constexpr int kVaried = 2;            ///< best hypotheses that are turned
constexpr std::array kFineTurnsDeg = {-6.0, -4.0, -2.5, -1.5, -0.7, 0.7, 1.5, 2.5, 4.0, 6.0};
constexpr double kGain = 0.004;  ///< of the score; less is chance

/// They keep more than those of the first search.
constexpr std::array<SearchRound, 4> kWideRounds = {{{3, 0, 0.00, 0.050, 300, 4.0, 3.0},
                                                     {3, 10, 0.10, 0.040, 96, 4.0, 3.0},
                                                     {2, 15, 0.05, 0.025, 32, 3.0, 6.0},
                                                     {1, 15, 0.02, 0.015, 12, 3.0, 7.0}}};

Hypothesis turned(const Hypothesis& from, const Eigen::Vector3d& axis, double degrees) {
  const Eigen::Translation3d there(from.weakest.point);
  Hypothesis h;
  h.candidate.generator = from.candidate.generator;
  h.candidate.pose1_from_pose2 =
      there * Eigen::AngleAxisd(to_radians(degrees), axis) * there.inverse() * from.candidate.pose1_from_pose2;
  return h;
}

/// All turns about the axis that is held least, either way up.
void add_turns(const Hypothesis& from, std::vector<Hypothesis>& field) {
  const Eigen::Vector3d& axis = from.weakest.axis;
  const Eigen::Vector3d across = axis.unitOrthogonal();
  for (double degrees = 0.0; degrees < 359.0; degrees += kTurnStepDeg) {
    if (degrees > 0.0) field.push_back(turned(from, axis, degrees));
    field.push_back(turned(from, Eigen::AngleAxisd(to_radians(0.5 * degrees), axis) * across, 180.0));
  }
}

}  // namespace

void search_wider(std::vector<Hypothesis>& field, const PoseInput& pose1, const PoseInput& pose2,
                  const PoseOptions& options, Scene& scene) {
  PoseEstimate counts;
  auto proposed = propose(pose1, pose2, options, scene, counts);
  if (!proposed) return;
  for (std::size_t i = 0; i < std::min<std::size_t>(kVaried, field.size()); ++i) add_turns(field[i], *proposed);
  for (const SearchRound& round : kWideRounds) narrow(*proposed, scene, options, round);
  field.insert(field.end(), std::make_move_iterator(proposed->begin()), std::make_move_iterator(proposed->end()));
  SearchRound verdict = options.rounds.back();
  verdict.iterations = 0;
  verdict.contradiction_weight = options.last_round.contradiction_weight;
  narrow(field, scene, options, verdict);
}

void turn_finely(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options) {
  std::vector<Hypothesis> turns;
  for (const double degrees : kFineTurnsDeg) turns.push_back(turned(field[0], field[0].weakest.axis, degrees));
  SearchRound round = options.rounds.back();
  round.apart_deg = 0.0;
  round.keep = turns.size();
  narrow(turns, scene, options, round);
  std::vector<Hypothesis> all = {field[0]};
  all.insert(all.end(), std::make_move_iterator(turns.begin()), std::make_move_iterator(turns.end()));
  judge(all, options);
  const double weight = options.last_round.contradiction_weight;
  const double best = all[0].candidate.agreement.score(weight);
  if (best > field[0].candidate.agreement.score(weight) + kGain) field[0] = std::move(all[0]);
}

}  // namespace scanrig
