#include <cmath>
#include <utility>

#include "pipeline/pose/pose_search.h"

namespace scanrig {
namespace {

double height_above_table(const Mesh& solid) { return reach_along(solid.vertices, Eigen::Vector3d::UnitY()); }

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

/// The paper's generator.
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

}  // namespace

Result<Scene> set_scene(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options) {
  Scene scene;
  const auto properties1 = solid_properties(pose1.solid);
  if (!properties1) return pass_on(properties1, "pose 1");
  const auto properties2 = solid_properties(pose2.solid);
  if (!properties2) return pass_on(properties2, "pose 2");
  scene.solid1 = {*properties1, height_above_table(pose1.solid), {}};
  scene.solid2 = {*properties2, height_above_table(pose2.solid), {}};
  scene.measured1 = pose1.measured ? *pose1.measured : measured_pose(pose1.views, options.levels);
  scene.measured2 = pose2.measured ? *pose2.measured : measured_pose(pose2.views, options.levels);
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

Result<std::vector<Hypothesis>> propose(const PoseInput& pose1, const PoseInput& pose2, const PoseOptions& options,
                                        Scene& scene, PoseEstimate& estimate) {
  std::vector<Hypothesis> field;
  if (options.stable_tangent_planes) {
    if (auto ok = add_rest_hypotheses(pose1, pose2, options, scene, estimate, field); !ok) return pass_on(ok);
  }
  if (options.point_pairs) add_point_pair_hypotheses(scene, options, field);
  add_pair(same_rest_pair(scene.solid1, scene.solid2), "turn on the table", scene, options.pairs, field);
  estimate.hypotheses = static_cast<int>(field.size());
  return field;
}

}  // namespace scanrig
