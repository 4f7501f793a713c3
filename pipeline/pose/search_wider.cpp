#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/units.h"
#include "pipeline/pose/pose_search.h"

namespace scanrig {
namespace {

constexpr double kTurnStepDeg = 5.0;      ///< of the turns about the axis that the shared surface holds least
constexpr std::size_t kTurned = 2;        ///< best hypotheses that are turned
constexpr std::size_t kTurnsJudged = 72;  ///< best of all on a coarser level
constexpr std::size_t kTurnsKept = 24;    ///< best of these; they are aligned

/// They keep more than those of the first search.
constexpr std::array<SearchRound, 4> kWideRounds = {{{3, 0, 0.00, 0.050, 300, 4.0, 3.0},
                                                     {3, 10, 0.10, 0.040, 96, 4.0, 3.0},
                                                     {2, 15, 0.05, 0.025, 32, 3.0, 6.0},
                                                     {1, 15, 0.02, 0.015, 12, 3.0, 7.0}}};

Hypothesis turned(const Hypothesis& from, const Eigen::Vector3d& axis, double degrees) {
  const Eigen::Translation3d there(from.weakest_turn.point);
  Hypothesis h;
  h.candidate.generator = from.candidate.generator;
  h.candidate.pose1_from_pose2 =
      there * Eigen::AngleAxisd(to_radians(degrees), axis) * there.inverse() * from.candidate.pose1_from_pose2;
  return h;
}

/// Not aligned; all are kept, the best first.
void judge_as_they_are(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options,
                       SearchRound round) {
  round.iterations = 0;
  round.keep = field.size();
  round.apart_deg = 0.0;
  narrow(field, scene, options, round);
  judge(field, options);
}

/// All with the same checks; the best distinct ones come first and are kept.
void join(std::vector<Hypothesis>& field, std::vector<Hypothesis> more, const Scene& scene,
          const PoseOptions& options) {
  field.insert(field.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  judge_as_they_are(field, scene, options, options.rounds.back());
  keep_distinct(field, scene, options, options.rounds.back().keep, options.rounds.back().apart_deg);
}

/// The first ones and the same end for end, aligned.
std::vector<Hypothesis> both_ways(const std::vector<Hypothesis>& field, std::size_t count, const Scene& scene,
                                  const PoseOptions& options) {
  std::vector<Hypothesis> bases;
  for (std::size_t i = 0; i < std::min(count, field.size()); ++i) {
    bases.push_back(field[i]);
    bases.push_back(turned(field[i], field[i].weakest_turn.axis.unitOrthogonal(), 180.0));
  }
  for (SearchRound round : kWideRounds) {
    if (round.iterations == 0) continue;
    round.keep = bases.size();
    narrow(bases, scene, options, round);
  }
  return bases;
}

/// All turns of the first ones about the axis that is held least, either way up. Each is judged before it is aligned:
/// but for the turn it is so already, and a turn is told by what contradicts it.
std::vector<Hypothesis> turns_of(const std::vector<Hypothesis>& field, std::size_t count, const Scene& scene,
                                 const PoseOptions& options) {
  std::vector<Hypothesis> turns;
  for (const Hypothesis& base : both_ways(field, count, scene, options)) {
    for (double degrees = 0.0; degrees < 359.0; degrees += kTurnStepDeg) {
      turns.push_back(turned(base, base.weakest_turn.axis, degrees));
    }
  }
  for (const auto& [round, kept] : {std::pair(options.rounds[2], kTurnsJudged), {options.rounds[3], kTurnsKept}}) {
    judge_as_they_are(turns, scene, options, round);
    turns.resize(std::min(kept, turns.size()));
  }
  SearchRound round = options.rounds.back();
  round.apart_deg = 0.0;
  round.keep = turns.size();
  narrow(turns, scene, options, round);
  return turns;
}

}  // namespace

void search_turns(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options) {
  join(field, turns_of(field, 1, scene, options), scene, options);
}

void search_wider(std::vector<Hypothesis>& field, const PoseInput& pose1, const PoseInput& pose2,
                  const PoseOptions& options, Scene& scene) {
  PoseEstimate counts;
  auto proposed = propose(pose1, pose2, options, scene, counts);
  if (!proposed) return;
  for (const SearchRound& round : kWideRounds) narrow(*proposed, scene, options, round);
  auto turns = turns_of(field, kTurned, scene, options);
  proposed->insert(proposed->end(), std::make_move_iterator(turns.begin()), std::make_move_iterator(turns.end()));
  join(field, std::move(*proposed), scene, options);
}

}  // namespace scanrig
