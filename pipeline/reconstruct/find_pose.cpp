#include <utility>
#include <vector>

#include "core/units.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/next_rest.h"
#include "pipeline/reconstruct/reconstruction_state.h"
#include "pipeline/reconstruct/report.h"
#include "pipeline/registration/refine_pose.h"
#include "pipeline/registration/register_views.h"

namespace scanrig {
namespace {

Result<PoseOptions> pose_options_of(const std::string& rests) {
  PoseOptions options;
  if (rests == "hull") {
    options.rests = PoseOptions::Rests::hull;
  } else if (rests == "egi") {
    options.rests = PoseOptions::Rests::egi;
  } else {
    return fail(ErrorCode::invalid_input, "rests \"{}\" is neither \"hull\" nor \"egi\"", rests);
  }
  return options;
}

}  // namespace

Result<Reconstruction::State::FoundPose> Reconstruction::State::find_pose(Report& report, const Context& context) {
  if (poses.size() < 2) return FoundPose{};
  const StageLog::Timer timer(log, "pose");
  const auto pose_options = pose_options_of(options.rests);
  if (!pose_options) return pass_on(pose_options);
  const PoseInput first{.solid = poses[0].partial.mesh, .views = poses[0].views};
  const PoseInput second{.solid = poses[1].partial.mesh, .views = poses[1].views};
  const auto estimate = estimate_pose(first, second, *pose_options, context);
  if (!estimate) return pass_on(estimate);
  report.add_estimate(*estimate);
  FoundPose found{.pose1_from_pose2 = estimate->pose1_from_pose2};
  RefineOptions refinement;
  refinement.contacts = estimate->best.contacts;
  refinement.held = estimate->symmetry.free_turns();
  if (estimate->symmetry.group != Symmetry::Group::none) {
    auto chosen = choose_turn(*estimate, report, context);
    if (!chosen) return pass_on(chosen);
    found = *chosen;
    // The symmetry carries the planes that the part touches to other planes that it touches.
    const Transform element = found.pose1_from_pose2 * estimate->pose1_from_pose2.inverse();
    for (Contact& contact : refinement.contacts) {
      contact.normal_in_pose1 = element.linear() * contact.normal_in_pose1;
      contact.offset_mm += contact.normal_in_pose1.dot(element.translation());
    }
  }
  if (calibration) {
    const RegistrationOptions known = registration_options(*calibration);
    refinement.axis = {to_radians(known.axis_tilt_sigma_deg), known.axis_shift_sigma_mm};
  }
  const auto refined = refine_pose(poses[0].views, poses[1].views, found.pose1_from_pose2, refinement, context);
  if (!refined) return pass_on(refined);
  report.add_refinement(*refined);
  found.pose1_from_pose2 = refined->pose1_from_pose2;
  return found;
}

/// Of the motions that the shape leaves open: by the colours, if these show it.
Result<Reconstruction::State::FoundPose> Reconstruction::State::choose_turn(const PoseEstimate& estimate,
                                                                            Report& report, const Context& context) {
  FoundPose found{.pose1_from_pose2 = estimate.pose1_from_pose2};
  if (poses[0].plain.empty() || poses[1].plain.empty()) {
    report.add_turn(estimate, nullptr);
    return found;
  }
  const auto colours = turn_by_colours(estimate, context);
  if (!colours) return pass_on(colours);
  report.add_turn(estimate, &*colours);
  found.layers = !colours->is_decided;
  if (!colours->is_decided) return found;
  found.pose1_from_pose2 = colours->pose1_from_pose2;
  if (turns_over(found.pose1_from_pose2)) return found;
  return fail(ErrorCode::same_rest,
              "the colours show that the object was not turned over between the two poses; lay it on another side and "
              "scan pose 2 again");
}

/// The next pose's table angles are this one's: the recipe is the same.
std::vector<RestSuggestion> Reconstruction::State::suggest_rests(std::size_t pose, const Mesh& live_pose) {
  const StageLog::Timer timer(log, "next rest");
  PoseState& state = poses[pose];
  const Calibration& rig = state.watch ? state.watch->calibration() : *calibration;
  std::vector<double> angles_rad;
  for (const View& view : state.views) angles_rad.push_back(view.angle_rad);
  const auto found = next_rests(state.partial.mesh, angles_rad, rig_eyes(rig));
  if (!found) return {};  // a partial model that is no solid: nothing is suggested
  auto suggestions = suggestions_of(*found, rig);
  for (RestSuggestion& suggestion : suggestions) {
    suggestion.png = draw_rest(live_pose, suggestion.next, rig).value_or("");
    state.suggested.push_back(suggestion.next);
  }
  return suggestions;
}

}  // namespace scanrig
