#include "pipeline/pose/estimate_pose.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig {
namespace {

/// A candidate during the search, with its checks.
struct Hypothesis {
  Candidate candidate;
  std::vector<SampleCheck> sample_checks;
  double score = 0.0;
  double condition = 0.0;
};

/// Inputs of the search from both poses.
struct Scene {
  RestingSolid solid1, solid2;
  std::vector<RestPair> pairs;
  MeasuredPose measured1, measured2;
  PoseObservations observations1, observations2;
  double size_mm = 0.0;
  Eigen::Vector3d middle2 = Eigen::Vector3d::Zero();  ///< of pose 2's object
};

bool alike(const Transform& a, const Transform& b, const Scene& scene, double degrees, double shift) {
  return rotation_angle(a.linear().transpose() * b.linear()) < to_radians(degrees) &&
         (a * scene.middle2 - b * scene.middle2).norm() < shift * scene.size_mm;
}

/// Confirmations fade with the distance: a ranking for motions that are still degrees off.
double soft_score(const std::vector<SampleCheck>& sample_checks, double reach_mm) {
  double sum = 0.0;
  for (const SampleCheck& t : sample_checks) {
    if (t.kind == SampleCheck::Kind::free_space) sum -= 1.0;
    if (t.kind == SampleCheck::Kind::surface) sum += 1.0 - std::abs(t.distance_mm) / reach_mm;
  }
  return sum / static_cast<double>(std::max<std::size_t>(sample_checks.size(), 1));
}

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
    }
    const double reach = round.reach * scene.size_mm;
    h.sample_checks = check_samples(scene.observations1, scene.observations2, h.candidate.pose1_from_pose2, round.level,
                                    reach, options.agreement);
    h.score = soft_score(h.sample_checks, reach);
  });
  std::stable_sort(field.begin(), field.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
  std::vector<Hypothesis> kept;
  for (Hypothesis& h : field) {
    if (kept.size() == round.keep) break;
    const bool is_known = std::ranges::any_of(kept, [&](const Hypothesis& k) {
      return alike(k.candidate.pose1_from_pose2, h.candidate.pose1_from_pose2, scene, round.apart_deg,
                   options.same_shift);
    });
    if (!is_known) kept.push_back(std::move(h));
  }
  field = std::move(kept);
}

double height_above_table(const Mesh& solid) { return reach_along(solid.vertices, Eigen::Vector3d::UnitY()); }

Result<Scene> set_scene(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options) {
  Scene scene;
  const auto properties1 = solid_properties(pose1.solid);
  if (!properties1) return pass_on(properties1, "pose 1");
  const auto properties2 = solid_properties(pose2.solid);
  if (!properties2) return pass_on(properties2, "pose 2");
  scene.solid1 = {*properties1, height_above_table(pose1.solid), {}};
  scene.solid2 = {*properties2, height_above_table(pose2.solid), {}};
  scene.measured1 = measured_pose(pose1.views, options.levels);
  scene.measured2 = measured_pose(pose2.views, options.levels);
  scene.size_mm = 0.5 * (scene.measured1.size_mm + scene.measured2.size_mm);
  scene.middle2 = properties2->centre_of_mass;
  for (const MeasuredPose* pose : {&scene.measured1, &scene.measured2}) {
    if (pose->samples[options.levels - 2].size() < options.min_samples) {
      return fail(ErrorCode::degenerate, "pose estimation: pose {} has almost no measured surface",
                  pose == &scene.measured1 ? 1 : 2);
    }
  }
  return scene;
}

void add_pair(const RestPair& pair, const char* generator, const Scene& scene, const RestPairOptions& options,
              std::vector<Hypothesis>& field) {
  for (const double swivel : swivels_of(pair, options)) {
    Hypothesis h;
    h.candidate.pose1_from_pose2 =
        transform_of(pair, scene.solid1.properties, scene.solid2.properties, swivel, options);
    h.candidate.generator = generator;
    h.candidate.normal1 = pair.of_pose1.normal;
    h.candidate.normal2 = pair.of_pose2.normal;
    field.push_back(std::move(h));
  }
}

/// The paper's generator. `same rest` is always among the hypotheses: it can only be refused if it was tried.
Result<void> add_rest_hypotheses(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                 Scene& scene, PoseEstimate& estimate, std::vector<Hypothesis>& field) {
  const bool egi = options.rests == PoseOptions::Rests::egi;
  const auto find = egi ? &rests_on_sphere : &rests_on_hull;
  auto rests1 = find(pose1.solid, scene.solid1.properties, scene.solid2.height_mm, options.stable);
  if (!rests1) return pass_on(rests1, "pose 1");
  auto rests2 = find(pose2.solid, scene.solid2.properties, scene.solid1.height_mm, options.stable);
  if (!rests2) return pass_on(rests2, "pose 2");
  estimate.counts1 = rests1->counts;
  estimate.counts2 = rests2->counts;
  scene.solid1.rests = std::move(rests1->rests);
  scene.solid2.rests = std::move(rests2->rests);
  scene.pairs = pair_rests(scene.solid1, scene.solid2, options.pairs);
  estimate.pairs = static_cast<int>(scene.pairs.size());
  for (const RestPair& pair : scene.pairs) add_pair(pair, egi ? "egi" : "hull", scene, options.pairs, field);
  return {};
}

void add_point_pair_hypotheses(const Scene& scene, const PoseOptions& options, std::vector<Hypothesis>& field) {
  const auto level = static_cast<std::size_t>(options.levels - 2);
  for (const Vote& vote : vote_by_point_pairs(scene.measured1.samples[level], scene.measured2.samples[level],
                                              scene.size_mm, options.point_pair_motions, options.voting)) {
    Hypothesis h;
    h.candidate.pose1_from_pose2 = vote.pose1_from_pose2;
    h.candidate.generator = "point pairs";
    field.push_back(std::move(h));
  }
}

/// Degrees between the vertical of pose 2 and that of pose 1.
double tilt_deg(const Transform& pose1_from_pose2) {
  const Eigen::Vector3d up = pose1_from_pose2.linear().col(1);
  return to_degrees(std::atan2(std::hypot(up.x(), up.z()), up.y()));
}

std::string describe(const Candidate& c) {
  const Eigen::AngleAxisd turn(c.pose1_from_pose2.linear());
  return fmt::format("{:.1f} deg about ({:.2f}, {:.2f}, {:.2f}), {:.0f} % confirmed, {:.1f} % contradicted",
                     to_degrees(turn.angle()), turn.axis().x(), turn.axis().y(), turn.axis().z(),
                     100.0 * c.agreement.confirmed, 100.0 * c.agreement.contradicted);
}

/// Judges all with one tolerance: the spread of the best fitting hypothesis that covers enough.
void judge(std::vector<Hypothesis>& field, const PoseOptions& options) {
  double spread = std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : field) {
    const Agreement loose =
        count_agreement(h.sample_checks, std::numeric_limits<double>::infinity(), options.agreement);
    if (loose.confirmed > options.min_overlap) spread = std::min(spread, 1.4826 * loose.median_mm);
  }
  for (Hypothesis& h : field) h.candidate.agreement = count_agreement(h.sample_checks, spread, options.agreement);
  std::stable_sort(field.begin(), field.end(), [](const Hypothesis& a, const Hypothesis& b) {
    return a.candidate.agreement.score() > b.candidate.agreement.score();
  });
  for (Hypothesis& h : field) {
    const AgreementGap with_best = compare(field[0].sample_checks, h.sample_checks, spread, options.agreement);
    Candidate& c = h.candidate;
    c.contradicted_more = with_best.contradicted_more;
    c.separable = with_best.separable;
    c.angle_to_best_deg = to_degrees(
        rotation_angle(field[0].candidate.pose1_from_pose2.linear().transpose() * c.pose1_from_pose2.linear()));
  }
}

/// True for another solution that the measurements do not separate from `best`.
bool is_rival(const Candidate& c, const Candidate& best, const PoseOptions& options) {
  return c.angle_to_best_deg > options.same_deg && !c.separable &&
         c.agreement.confirmed > options.rival_share * best.agreement.confirmed;
}

/// Refines the candidates that are not yet separable at full resolution; the others stay behind these finalists.
void settle(std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options) {
  if (field.empty()) return;
  judge(field, options);
  const auto rivals = std::stable_partition(field.begin() + 1, field.end(), [&](const Hypothesis& h) {
    return is_rival(h.candidate, field[0].candidate, options);
  });
  if (rivals - field.begin() < 2) return;
  std::vector<Hypothesis> finalists(std::make_move_iterator(field.begin()), std::make_move_iterator(rivals));
  std::vector<Hypothesis> others(std::make_move_iterator(rivals), std::make_move_iterator(field.end()));
  SearchRound round = options.last_round;
  round.keep = finalists.size();
  round.apart_deg = options.same_deg;
  narrow(finalists, scene, options, round);
  judge(finalists, options);
  field = std::move(finalists);
  field.insert(field.end(), std::make_move_iterator(others.begin()), std::make_move_iterator(others.end()));
}

Result<void> decide(const std::vector<Hypothesis>& field, const Scene& scene, const PoseOptions& options) {
  if (field.empty())
    return fail(ErrorCode::no_overlap, "pose estimation: no motion between the poses could be proposed");
  const Candidate& best = field[0].candidate;
  const Agreement& t = best.agreement;
  if (t.confirmed < options.min_overlap || t.contradicted > options.max_contradicted * (t.confirmed + t.contradicted) ||
      t.median_mm > options.max_median * scene.size_mm) {
    return fail(ErrorCode::no_overlap,
                "pose estimation: the two poses do not fit together; the best of {} tried: {}. "
                "Check that it is the same object and that the poses share enough surface",
                field.size(), describe(best));
  }
  std::string others;
  bool all_same_rest = tilt_deg(best.pose1_from_pose2) < options.same_rest_tilt_deg;
  for (const Hypothesis& h : field) {
    const Candidate& c = h.candidate;
    if (!is_rival(c, best, options)) continue;
    others += fmt::format("; {}", describe(c));
    all_same_rest = all_same_rest && tilt_deg(c.pose1_from_pose2) < options.same_rest_tilt_deg;
  }
  if (all_same_rest) {
    return fail(ErrorCode::same_rest,
                "pose estimation: the object was not turned over between the two poses, it only turned "
                "about the vertical by {:.1f} deg; lay it on another side and scan pose 2 again",
                to_degrees(Eigen::AngleAxisd(best.pose1_from_pose2.linear()).angle()));
  }
  if (!others.empty()) {
    return fail(ErrorCode::ambiguous,
                "pose estimation: the part is too symmetric, several motions fit: {}{}. Add a mark of clay or "
                "change pose 2",
                describe(best), others);
  }
  return {};
}

}  // namespace

Result<PoseEstimate> estimate_pose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                   const Context& context) {
  auto scene = set_scene(pose1, pose2, options);
  if (!scene) return pass_on(scene);
  scene->observations1 = {&scene->measured1, pose1.views};
  scene->observations2 = {&scene->measured2, pose2.views};
  if (context.stopped()) return fail(ErrorCode::stopped, "pose estimation: stopped");
  PoseEstimate estimate;
  std::vector<Hypothesis> field;
  if (options.stable_tangent_planes) {
    if (auto ok = add_rest_hypotheses(pose1, pose2, options, *scene, estimate, field); !ok) return pass_on(ok);
  }
  if (options.point_pairs) add_point_pair_hypotheses(*scene, options, field);
  add_pair(same_rest_pair(scene->solid1, scene->solid2), "turn on the table", *scene, options.pairs, field);
  estimate.hypotheses = static_cast<int>(field.size());

  std::size_t rounds_done = 0;
  for (const SearchRound& round : options.rounds) {
    if (context.stopped()) return fail(ErrorCode::stopped, "pose estimation: stopped");
    narrow(field, *scene, options, round);
    if (round.iterations == 0) estimate.refined = static_cast<int>(field.size());
    context.report("pose", static_cast<double>(++rounds_done) / static_cast<double>(options.rounds.size()));
  }
  settle(field, *scene, options);
  if (auto ok = decide(field, *scene, options); !ok) return pass_on(ok);
  estimate.best = field[0].candidate;
  estimate.pose1_from_pose2 = estimate.best.pose1_from_pose2;
  estimate.overlap = estimate.best.agreement.confirmed;
  estimate.condition = field[0].condition;
  for (std::size_t i = 1; i < field.size(); ++i) estimate.alternatives.push_back(field[i].candidate);
  return estimate;
}

}  // namespace scanrig
