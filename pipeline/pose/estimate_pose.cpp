#include "pipeline/pose/estimate_pose.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/units.h"
#include "pipeline/pose/equivalent_motions.h"
#include "pipeline/pose/pose_search.h"

namespace scanrig {
namespace {

std::string describe(const Candidate& c) {
  const Eigen::AngleAxisd turn(c.pose1_from_pose2.linear());
  return fmt::format("{:.1f} deg about ({:.2f}, {:.2f}, {:.2f}), {:.0f} % confirmed, {:.1f} % contradicted",
                     to_degrees(turn.angle()), turn.axis().x(), turn.axis().y(), turn.axis().z(),
                     100.0 * c.agreement.confirmed, 100.0 * c.agreement.contradicted);
}

/// Whether the surfaces agree, hold the motion well, and leave no other: then what speaks against it is images alone. A
/// dark part that mirrors the screen is taken for background in several views of one pose.
bool is_denied_by_images_alone(const std::vector<Hypothesis>& field, const PoseOptions& options) {
  const Agreement& best = field[0].candidate.agreement;
  const double by_surface = (best.contradicted - best.free_space) / std::max(best.confirmed, 1e-9);
  return field[0].condition < options.weak_condition && by_surface < options.search_again_contradicted &&
         rivals_of(field, options).empty();
}

Result<void> decide(const std::vector<Hypothesis>& field, const Scene& scene, PoseOptions options) {
  if (field.empty())
    return fail(ErrorCode::no_overlap, "pose estimation: no motion between the poses could be proposed");
  const Candidate& best = field[0].candidate;
  if (is_denied_by_images_alone(field, options)) {
    options.max_contradicted = std::max(options.max_contradicted, options.max_denied_by_images);
  }
  if (!fits(best.agreement, scene.size_mm, options)) {
    return fail(ErrorCode::no_overlap,
                "pose estimation: the two poses do not fit together; the best of {} tried: {}. "
                "Check that it is the same object and that the poses share enough surface",
                field.size(), describe(best));
  }
  return {};
}

/// The verdict on what the rounds have left; searched for again where even the best contradicts.
void conclude(std::vector<Hypothesis>& field, const PoseInput& pose1, const PoseInput& pose2, Scene& scene,
              const PoseOptions& options) {
  if (field.empty()) return;
  judge(field, options);
  if (field[0].condition > options.weak_condition) search_turns(field, scene, options);
  settle(field, scene, options);
  if (field[0].candidate.agreement.contradicted_share() <= options.search_again_contradicted) return;
  search_wider(field, pose1, pose2, options, scene);
  settle(field, scene, options);
}

Result<void> not_turned_over(const Transform& motion) {
  return fail(ErrorCode::same_rest,
              "pose estimation: the object was not turned over between the two poses, it only turned "
              "about the vertical by {:.1f} deg; lay it on another side and scan pose 2 again",
              to_degrees(Eigen::AngleAxisd(motion.linear()).angle()));
}

/// Of the best and its rivals the one that was picked comes first. Whether one of them is it.
bool take_picked(std::vector<Hypothesis>& field, const PoseOptions& options) {
  if (!options.picked) return false;
  auto nearest = field.end();
  double nearest_deg = options.same_deg;
  for (auto h = field.begin(); h != field.end(); ++h) {
    if (h != field.begin() && !is_rival(h->candidate, field[0].candidate, options)) continue;
    const auto& linear = h->candidate.pose1_from_pose2.linear();
    const double away_deg = to_degrees(rotation_angle(options.picked->linear().transpose() * linear));
    if (away_deg >= nearest_deg) continue;
    nearest = h;
    nearest_deg = away_deg;
  }
  if (nearest == field.end()) return false;
  std::rotate(field.begin(), nearest, nearest + 1);
  for (Hypothesis& h : field) h.candidate.angle_to_best_deg = apart_deg(h.candidate, field[0].candidate);
  return true;
}

/// Where all that is left only turns the object on the table: the rivals, and motions that turn it over and contradict
/// nothing. These may confirm less than a rival must, for they show less surface twice.
std::vector<const Candidate*> with_turned_over(const std::vector<Hypothesis>& field,
                                               std::vector<const Candidate*> rivals, const PoseOptions& options) {
  for (const Hypothesis& h : field) {
    const Candidate& c = h.candidate;
    if (turns_over(c.pose1_from_pose2, options) && !c.separable && c.angle_to_best_deg > options.same_deg &&
        c.agreement.confirmed >= options.min_overlap &&
        c.agreement.contradicted_share() <= options.search_again_contradicted) {
      rivals.push_back(&c);
    }
  }
  return rivals;
}

/// Rivals that give the same surface are one answer; others are `ambiguous`.
Result<void> resolve_rivals(std::vector<Hypothesis>& field, const PoseInput& pose1, const PoseInput& pose2,
                            const Scene& scene, const PoseOptions& options, PoseEstimate& estimate) {
  const auto rivals = rivals_of(field, options);
  std::vector<const Candidate*> all = rivals;
  all.insert(all.begin(), &field[0].candidate);
  const auto left =
      std::ranges::find_if(all, [&](const Candidate* c) { return !turns_over(c->pose1_from_pose2, options); });
  const bool is_all_left =
      std::ranges::none_of(all, [&](const Candidate* c) { return turns_over(c->pose1_from_pose2, options); });
  if (rivals.empty()) return is_all_left ? not_turned_over(field[0].candidate.pose1_from_pose2) : Result<void>{};
  std::optional<Symmetry> symmetry;
  if (is_all_left) {
    symmetry = symmetry_of(field[0], with_turned_over(field, rivals, options), pose1, pose2, scene, options);
  }
  if (!symmetry) symmetry = symmetry_of(field[0], rivals, pose1, pose2, scene, options);
  if (!symmetry && take_picked(field, options)) {
    estimate.is_picked = true;
    return {};
  }
  if (!symmetry && !is_all_left) {
    return fail(ErrorCode::ambiguous,
                "pose estimation: the part is too symmetric, {} motions fit that give different shapes; the best two: "
                "{}; {}. Choose the right one, add a pose that decides, or scan again with a mark of clay",
                all.size(), describe(*all[0]), describe(*all[1]));
  }
  if (left != all.end()) {
    const Transform motion = (*left)->pose1_from_pose2;
    if (!symmetry || !may_be_turned_over(motion, *symmetry, scene, options)) return not_turned_over(motion);
    estimate.turned_over_is_assumed = true;
  }
  if (symmetry->group == Symmetry::Group::spherical) estimate.turned_over_is_assumed = true;
  prefer_turned_over(field, *symmetry, scene, options);
  estimate.symmetry = std::move(*symmetry);
  return {};
}

}  // namespace

RefineOptions after_search() {
  RefineOptions options;
  options.levels = 2;
  options.capture = 0.02;
  options.keep = 1.0;
  options.robust_scales = 10.0;
  return options;
}

bool fits(const Agreement& t, double size_mm, const PoseOptions& options) {
  return t.confirmed >= options.min_overlap &&
         t.contradicted <= options.max_contradicted * (t.confirmed + t.contradicted) &&
         !(t.median_mm > options.max_median * size_mm);
}

Result<PoseEstimate> estimate_pose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                   const Context& context) {
  std::vector<Candidate> fitting;
  return estimate_pose(pose1, pose2, options, context, fitting);
}

Result<PoseEstimate> estimate_pose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                   const Context& context, std::vector<Candidate>& fitting) {
  auto scene = set_scene(pose1, pose2, options);
  if (!scene) return pass_on(scene);
  scene->observations1 = {&scene->measured1, pose1.views};
  scene->observations2 = {&scene->measured2, pose2.views};
  if (context.stopped()) return fail(ErrorCode::stopped, "pose estimation: stopped");
  PoseEstimate estimate;
  auto proposed = propose(pose1, pose2, options, *scene, estimate);
  if (!proposed) return pass_on(proposed);
  std::vector<Hypothesis>& field = *proposed;

  std::size_t rounds_done = 0;
  for (const SearchRound& round : options.rounds) {
    if (context.stopped()) return fail(ErrorCode::stopped, "pose estimation: stopped");
    narrow(field, *scene, options, round);
    if (round.iterations == 0) estimate.refined = static_cast<int>(field.size());
    context.report("pose", static_cast<double>(++rounds_done) / static_cast<double>(options.rounds.size()));
  }
  conclude(field, pose1, pose2, *scene, options);
  if (auto ok = decide(field, *scene, options); !ok) return pass_on(ok);
  fitting = {field[0].candidate};
  for (const Candidate* rival : rivals_of(field, options)) fitting.push_back(*rival);
  if (auto ok = resolve_rivals(field, pose1, pose2, *scene, options, estimate); !ok) return pass_on(ok);
  estimate.best = field[0].candidate;
  estimate.pose1_from_pose2 = estimate.best.pose1_from_pose2;
  estimate.overlap = estimate.best.agreement.confirmed;
  estimate.condition = field[0].condition;
  for (std::size_t i = 1; i < field.size(); ++i) estimate.alternatives.push_back(field[i].candidate);
  return estimate;
}

}  // namespace scanrig
