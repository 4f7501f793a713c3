#include <utility>
#include <vector>

#include "core/units.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/next_rest.h"
#include "pipeline/pose/refine_found.h"
#include "pipeline/reconstruct/reconstruction_state.h"
#include "pipeline/reconstruct/report.h"
#include "pipeline/registration/refine_pose.h"
#include "pipeline/registration/register_views.h"

namespace scanrig {

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

std::vector<Contact> carried(std::vector<Contact> contacts, const Transform& element) {
  for (Contact& contact : contacts) {
    contact.normal_in_pose1 = element.linear() * contact.normal_in_pose1;
    contact.offset_mm += contact.normal_in_pose1.dot(element.translation());
  }
  return contacts;
}

RefineOptions Reconstruction::State::refine_options() const {
  RefineOptions refinement = after_search();
  if (calibration) {
    const RegistrationOptions known = registration_options(*calibration);
    refinement.axis = {to_radians(known.axis_tilt_sigma_deg), known.axis_shift_sigma_mm};
    refinement.calibration = calibration_modes(*calibration, rectification->left_from_turntable);
  }
  return refinement;
}

Result<Reconstruction::State::FoundPoses> Reconstruction::State::find_touching(const PoseOptions& pose_options,
                                                                               Report& report, const Context& context) {
  return poses.size() == 2 ? find_second_pose(pose_options, report, context)
                           : find_many_poses(pose_options, report, context);
}

Result<Reconstruction::State::FoundPoses> Reconstruction::State::find_second_pose(const PoseOptions& pose_options,
                                                                                  Report& report,
                                                                                  const Context& context) {
  const MeasuredPose measured1 = measured_pose(poses[0].views, pose_options.levels);
  const MeasuredPose measured2 = measured_pose(poses[1].views, pose_options.levels);
  const PoseInput first{.solid = poses[0].partial.mesh, .views = poses[0].views, .measured = &measured1};
  const PoseInput second{.solid = poses[1].partial.mesh, .views = poses[1].views, .measured = &measured2};
  std::vector<Candidate> fitting;
  const auto estimate = estimate_pose(first, second, pose_options, context, fitting);
  if (!estimate && estimate.error().code == ErrorCode::ambiguous) keep_choices(fitting);
  if (!estimate) return pass_on(estimate);
  report.add_estimate(*estimate);
  FoundPoses found{.model_from_pose = {Transform::Identity(), estimate->pose1_from_pose2}};
  RefineOptions refinement = refine_options();
  refinement.contacts = estimate->best.contacts;
  refinement.held = estimate->symmetry.free_turns();
  if (estimate->symmetry.group != Symmetry::Group::none) {
    auto chosen = choose_turn(*estimate, report, context);
    if (!chosen) return pass_on(chosen);
    found = *chosen;
    // The symmetry carries the planes that the part touches to other planes that it touches.
    const Transform element = *found.model_from_pose[1] * estimate->pose1_from_pose2.inverse();
    refinement.contacts = carried(std::move(refinement.contacts), element);
  }
  const auto refined = refine_found({&measured1, poses[0].views}, {&measured2, poses[1].views},
                                    *found.model_from_pose[1], refinement, pose_options, context);
  if (!refined) return pass_on(refined);
  report.add_refinement(*refined, !refinement.held.empty());
  found.model_from_pose[1] = refined->pose1_from_pose2;
  found.seen_empty = estimate->best.agreement.free_space;
  return found;
}

/// For a person, who may know what no measurement separates.
void Reconstruction::State::keep_choices(const std::vector<Candidate>& fitting) {
  const Mesh first = live_pose(0), second = live_pose(1);
  choices.clear();
  for (const Candidate& candidate : fitting) {
    PoseChoice& choice = choices.emplace_back();
    choice.pose1_from_pose2 = candidate.pose1_from_pose2;
    choice.sentence =
        fmt::format("pose 2 turned by {:.0f} deg: {:.0f} % of the surface confirmed, {:.1f} % contradicted",
                    to_degrees(rotation_angle(candidate.pose1_from_pose2.linear())),
                    100 * candidate.agreement.confirmed, 100 * candidate.agreement.contradicted);
    if (calibration) choice.png = draw_choice(first, second, choice.pose1_from_pose2, *calibration).value_or("");
  }
}

/// Of the motions that the shape leaves open: by the colours, if these show it.
Result<Reconstruction::State::FoundPoses> Reconstruction::State::choose_turn(const PoseEstimate& estimate,
                                                                             Report& report, const Context& context) {
  FoundPoses found{.model_from_pose = {Transform::Identity(), estimate.pose1_from_pose2}};
  if (poses[0].plain.empty() || poses[1].plain.empty()) {
    report.add_turn(estimate, nullptr);
    return found;
  }
  const auto colours = turn_by_colours(0, 1, estimate, context);
  if (!colours) return pass_on(colours);
  report.add_turn(estimate, &*colours);
  found.layers = !colours->is_decided;
  if (!colours->is_decided) return found;
  found.model_from_pose[1] = colours->pose1_from_pose2;
  if (turns_over(colours->pose1_from_pose2)) return found;
  return fail(ErrorCode::same_rest,
              "the colours show that the object was not turned over between the two poses; lay it on another side and "
              "scan pose 2 again");
}

/// Nothing of an object on a fixture: what it stands on is no rest of its own. The next pose's table angles are this
/// one's: the recipe is the same.
std::vector<RestSuggestion> Reconstruction::State::suggest_rests(std::size_t pose, const Mesh& live_pose) {
  if (options.fixture) return {};
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
