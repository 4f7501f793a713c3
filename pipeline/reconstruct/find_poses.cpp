#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "pipeline/pose/place_poses.h"
#include "pipeline/reconstruct/reconstruction_state.h"
#include "pipeline/reconstruct/report.h"
#include "pipeline/registration/refine_poses.h"

namespace scanrig {
namespace {

bool is_symmetric(const PosePair& pair) {
  return pair.estimate && pair.estimate->symmetry.group != Symmetry::Group::none;
}

/// Every pair that was searched and found has motions that fit alike: the part is symmetric, and no pair holds its
/// turn.
bool is_symmetric_part(const PlacedPoses& placed) {
  const auto is_open = [](const PosePair& pair) {
    return !pair.pose1_from_pose2 || !pair.estimate || is_symmetric(pair);
  };
  return std::ranges::any_of(placed.pairs, is_symmetric) && std::ranges::all_of(placed.pairs, is_open);
}

/// Of the poses that are kept, in their order.
std::vector<std::size_t> kept_poses(const PlacedPoses& placed) {
  std::vector<std::size_t> kept;
  for (std::size_t pose = 0; pose < placed.model_from_pose.size(); ++pose) {
    if (placed.model_from_pose[pose]) kept.push_back(pose);
  }
  return kept;
}

/// Pairs that share surface, numbered among the poses that are kept.
std::vector<PoseLink> links_of(const PlacedPoses& placed, const std::vector<std::size_t>& kept,
                               std::span<const std::optional<Transform>> model_from_pose) {
  const bool is_open = is_symmetric_part(placed);
  const auto number = [&](std::size_t pose) {
    return static_cast<std::size_t>(std::ranges::find(kept, pose) - kept.begin());
  };
  std::vector<PoseLink> links;
  for (const PosePair& pair : placed.pairs) {
    if (!pair.pose1_from_pose2 || pair.judged.kind != PairVerdict::Kind::agrees) continue;
    PoseLink& link = links.emplace_back(PoseLink{number(pair.pose1), number(pair.pose2)});
    if (pair.verdict != PosePair::Verdict::agrees || !pair.estimate) continue;
    const Transform motion = model_from_pose[pair.pose1]->inverse() * *model_from_pose[pair.pose2];
    const Transform element = motion * pair.estimate->pose1_from_pose2.inverse();
    link.contacts = pair.estimate->best.contacts;
    // A symmetry carries the planes that the part touches to other planes that it touches.
    if (is_symmetric(pair)) link.contacts = carried(std::move(link.contacts), element);
    if (is_open) link.held = pair.estimate->symmetry.free_turns();
  }
  return links;
}

}  // namespace

/// Of a symmetric part: each pose's turn against the first by the paint that both show. Where one shows none, no place
/// of the model gets colours of several poses.
Result<void> Reconstruction::State::choose_turns(const PlacedPoses& placed, FoundPoses& found, const Context& context) {
  const std::size_t first = kept_poses(placed).front();
  for (const std::size_t pose : kept_poses(placed)) {
    if (pose == first) continue;
    const auto pair =
        std::ranges::find_if(placed.pairs, [&](const PosePair& p) { return p.pose1 == first && p.pose2 == pose; });
    if (!pair->estimate || poses[first].plain.empty() || poses[pose].plain.empty()) {
      found.layers = true;
      continue;
    }
    const auto colours = turn_by_colours(first, pose, *pair->estimate, context);
    if (!colours) return pass_on(colours);
    if (colours->is_decided) {
      found.model_from_pose[pose] = colours->pose1_from_pose2;
    } else {
      found.layers = true;
    }
  }
  return {};
}

Result<Reconstruction::State::FoundPoses> Reconstruction::State::find_many_poses(const PoseOptions& pose_options,
                                                                                 Report& report,
                                                                                 const Context& context) {
  std::vector<PoseInput> inputs;
  for (const PoseState& pose : poses) inputs.push_back({.solid = pose.partial.mesh, .views = pose.views});
  const auto placed = place_poses(inputs, pose_options, context);
  if (!placed) return pass_on(placed);
  for (const LeftOutPose& pose : placed->left_out) disagreements.push_back(of_pose(pose.pose, pose.sentence));
  FoundPoses found{.model_from_pose = placed->model_from_pose};
  if (is_symmetric_part(*placed)) {
    if (auto done = choose_turns(*placed, found, context); !done) return pass_on(done);
  }
  const std::vector<std::size_t> kept = kept_poses(*placed);
  std::vector<std::span<const View>> views;
  std::vector<Transform> starts;
  for (const std::size_t pose : kept) {
    views.emplace_back(poses[pose].views);
    starts.push_back(*found.model_from_pose[pose]);
  }
  const auto links = links_of(*placed, kept, found.model_from_pose);
  const auto refined = refine_poses(views, starts, links, refine_options(), context);
  if (!refined) return pass_on(refined);
  for (std::size_t i = 0; i < kept.size(); ++i) found.model_from_pose[kept[i]] = refined->model_from_pose[i];
  for (const PosePair& pair : placed->pairs) {
    if (pair.pose1_from_pose2) found.seen_empty = std::max(found.seen_empty, pair.judged.contradicted);
  }
  report.add_placed(*placed, kept, links, *refined, found.layers);
  return found;
}

}  // namespace scanrig
