#include <algorithm>
#include <utility>

#include "pipeline/range/view_builder.h"
#include "pipeline/reconstruct/reconstruction_state.h"
#include "pipeline/registration/moved_views.h"
#include "pipeline/volume/silhouette_votes.h"

namespace scanrig {
namespace {

/// Of the measured surface, outside of several silhouettes: beyond it the key is wrong, not single images. A sound scan
/// has none, one image less than this.
constexpr double kMaxDisputed = 0.05;
constexpr int kRounds = 3;  ///< of registration, while it shows that views stand elsewhere

/// Imported views: table angles that are all the same are none, and the views have no order.
RegistrationOptions options_of_imported(std::span<const View> views) {
  const auto is_turned = [&](const View& view) { return view.angle_rad != views.front().angle_rad; };
  return std::ranges::any_of(views, is_turned) ? RegistrationOptions::imported() : RegistrationOptions::placed();
}

}  // namespace

Result<void> Reconstruction::State::align_views(std::size_t pose, const Context& context) {
  PoseState& state = poses[pose];
  const auto priors = calibration ? registration_options(*calibration) : options_of_imported(state.views);
  // Before registration, which would spread a motion over the views around; and after it, where the axis is mended.
  undo_motions(pose, priors);
  for (int round = 0; round < kRounds; ++round) {
    auto report = register_views(state.views, priors, context);
    if (!report) return pass_on(report);
    state.registration = std::move(*report);
    if (round + 1 == kRounds) break;
    const bool has_moved = undo_motions(pose, priors), is_less = leave_out_misfits(pose);
    if (!has_moved && !is_less) break;
  }
  return {};
}

/// Whether there were any. Imported views were placed by hand.
bool Reconstruction::State::undo_motions(std::size_t pose, const RegistrationOptions& priors) {
  if (!calibration) return false;
  PoseState& state = poses[pose];
  const auto motions = find_object_motions(state.views, priors);
  for (const ObjectMotion& motion : motions) {
    undo_motion(state.views, motion);
    disagreements.push_back(of_motion(pose, state.views[motion.view], motion));
  }
  return !motions.empty();
}

/// Registration, and what the registered views say of each other's images. Imported views have no silhouettes.
Result<void> Reconstruction::State::register_pose(std::size_t pose, const Context& context) {
  const StageLog::Timer timer(log, "registration");
  context.report("registration", 0.0);
  if (auto done = align_views(pose, context); !done) return done;
  if (calibration) {
    if (auto done = judge_silhouettes(pose, context); !done) return done;
  }
  PoseState& state = poses[pose];
  if (state.watch) state.watch->add_overlap(state.registration);
  return {};
}

Result<void> Reconstruction::State::judge_silhouettes(std::size_t pose, const Context& context) {
  PoseState& state = poses[pose];
  const auto is_bare = [](const View& view) { return view.silhouettes.empty() || !view.range.background_is_whole; };
  const auto bare = std::ranges::count_if(state.views, is_bare);
  if (bare > 0 && !state.plain.empty()) {
    disagreements.push_back(of_missing_screen(pose, std::ranges::find_if(state.views, is_bare)->index,
                                              static_cast<std::size_t>(bare), state.views.size()));
  }
  const auto verdict = vote_on_silhouettes(state.views, {}, context);
  if (!verdict) return pass_on(verdict);
  if (verdict->disputed_share > kMaxDisputed && !state.pattern.empty()) {
    disagreements.push_back(of_screen_colour(pose, verdict->disputed_share));
    return measure_without_key(pose, context);
  }
  for (const SilhouetteFinding& finding : verdict->findings) disagreements.push_back(of_silhouette(pose, finding));
  return {};
}

/// What one pose measured says of the others' silhouettes: the foot of each, where a dark object mirrors the table, is
/// another's top.
Result<void> Reconstruction::State::judge_silhouettes_of_all(const FoundPoses& found, const Context& context) {
  if (!calibration || poses.size() < 2) return {};
  std::vector<View> all;  // share their pixels with the poses' views
  std::vector<std::pair<std::size_t, std::size_t>> origin;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!found.model_from_pose[p]) continue;
    const Transform pose_from_model = p == 0 ? Transform::Identity() : found.model_from_pose[p]->inverse();
    for (std::size_t v = 0; v < poses[p].views.size(); ++v) {
      View& view = all.emplace_back(poses[p].views[v]);
      view.index = static_cast<int>(origin.size());
      view.range.camera_from_pose = view.range.camera_from_pose * pose_from_model;
      for (Silhouette& s : view.silhouettes) s.camera_from_pose = s.camera_from_pose * pose_from_model;
      origin.emplace_back(p, v);
    }
  }
  const auto verdict = vote_on_silhouettes(all, {.finds_surplus = false}, context);  // said of each pose already
  if (!verdict) return pass_on(verdict);
  for (std::size_t i = 0; i < all.size(); ++i) {
    View& view = poses[origin[i].first].views[origin[i].second];
    all[i].range.camera_from_pose = view.range.camera_from_pose;
    view.range = std::move(all[i].range);
    for (std::size_t c = 0; c < view.silhouettes.size(); ++c) {
      all[i].silhouettes[c].camera_from_pose = view.silhouettes[c].camera_from_pose;
      view.silhouettes[c] = std::move(all[i].silhouettes[c]);
    }
  }
  for (SilhouetteFinding finding : verdict->findings) {
    const auto [pose, view] = origin[static_cast<std::size_t>(finding.view)];
    finding.view = poses[pose].views[view].index;
    disagreements.push_back(of_silhouette(pose, finding));
  }
  return {};
}

/// All views of the pose anew, as of a rig without a screen: the object has its colour.
Result<void> Reconstruction::State::measure_without_key(std::size_t pose, const Context& context) {
  PoseState& state = poses[pose];
  ViewOptions without_key;
  without_key.plain_differs = false;
  for (std::size_t v = 0; v < state.views.size(); ++v) {
    const View& old = state.views[v];
    const auto images = whole_images(pose, v);
    if (!images) return pass_on(images, fmt::format("view {}", old.index));
    const StereoImages stereo{images->left_pattern, images->right_pattern, images->left_plain, images->right_plain};
    auto view = make_view(*rectification, stereo, old.angle_rad, old.index, without_key, context);
    if (!view) return pass_on(view, fmt::format("view {}", old.index));
    if (state.watch) state.watch->carry(*view, state.pattern[v].order);
    set_view(state, v, std::move(*view));
  }
  return align_views(pose, context);
}

/// Whether there were any.
bool Reconstruction::State::leave_out_misfits(std::size_t pose) {
  if (!calibration) return false;
  PoseState& state = poses[pose];
  const auto misfits = views_that_do_not_fit(state.views, state.registration);
  for (auto v = misfits.rbegin(); v != misfits.rend(); ++v) {
    const auto at = static_cast<std::ptrdiff_t>(*v);
    disagreements.push_back(of_misfit(pose, state.views[*v], state.registration.views[*v].median_after_mm));
    state.views.erase(state.views.begin() + at);
    if (!state.full.empty()) state.full.erase(state.full.begin() + at);
    if (state.plain.empty()) continue;
    state.plain.erase(state.plain.begin() + at);
    state.pattern.erase(state.pattern.begin() + at);
  }
  return !misfits.empty();
}

}  // namespace scanrig
