#include "pipeline/evaluate/evaluate.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/evaluate/ideal_carve.h"
#include "pipeline/evaluate/sigma_figures.h"
#include "pipeline/evaluate/texture_figures.h"
#include "pipeline/mesh/alignment.h"
#include "pipeline/mesh/self_intersection.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/registration/pose_uncertainty.h"

namespace scanrig {
namespace {

void for_each_sample(std::size_t count, const std::function<void(std::size_t)>& body) {
  constexpr std::size_t kBlock = 1024;
  parallel_for((count + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) body(i);
  });
}

DistanceFigures figures(const std::vector<double>& distances, double area) {
  DistanceFigures result;
  result.area_mm2 = area;
  if (distances.empty()) return result;
  const auto share_over = [&distances](double limit) {
    const auto over = std::count_if(distances.begin(), distances.end(), [limit](double d) { return !(d <= limit); });
    return static_cast<double>(over) / static_cast<double>(distances.size());
  };
  result.median = quantile(distances, 0.5);
  result.p95 = quantile(distances, 0.95);
  result.share_over_025 = share_over(0.25);
  result.share_over_050 = share_over(0.50);
  return result;
}

std::vector<SurfaceIndex::Nearest> nearest_to(const std::vector<SurfaceSample>& samples, const SurfaceIndex& surface,
                                              const Transform& motion = Transform::Identity()) {
  std::vector<SurfaceIndex::Nearest> nearest(samples.size());
  for_each_sample(samples.size(), [&](std::size_t i) { nearest[i] = surface.nearest(motion * samples[i].point); });
  return nearest;
}

std::vector<double> distances(const std::vector<SurfaceIndex::Nearest>& nearest) {
  std::vector<double> result;
  for (const auto& n : nearest) result.push_back(n.distance);
  return result;
}

Eigen::Vector3d face_normal(const Mesh& mesh, std::uint32_t face) {
  const Mesh::Face& f = mesh.faces[face];
  const Eigen::Vector3d a = mesh.vertices[f[0]].cast<double>();
  return (mesh.vertices[f[1]].cast<double>() - a).cross(mesh.vertices[f[2]].cast<double>() - a).normalized();
}

void score_normals(const std::vector<SurfaceSample>& samples, const std::vector<SurfaceIndex::Nearest>& nearest,
                   const Mesh& truth, Scores& scores) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d normal = face_normal(truth, nearest[i].face);
    angles.push_back(to_degrees(std::atan2(normal.cross(samples[i].normal).norm(), normal.dot(samples[i].normal))));
  }
  scores.normal_median_deg = quantile(angles, 0.5);
  scores.normal_p95_deg = quantile(angles, 0.95);
  const auto flipped = std::count_if(angles.begin(), angles.end(), [](double a) { return a > 90.0; });
  if (!angles.empty()) scores.flipped_share = static_cast<double>(flipped) / static_cast<double>(angles.size());
}

void score_sigma(const std::vector<SurfaceSample>& samples, const std::vector<SurfaceIndex::Nearest>& nearest,
                 const Mesh& model, Scores& scores) {
  if (model.sigma.empty()) return;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double sigma = sigma_at(model, samples[i]);
    if (sigma > 0.0) ratios.push_back(nearest[i].distance / sigma);
  }
  if (ratios.empty()) return;
  scores.sigma_ratio = quantile(ratios, 0.5) / kNormalMedian;
  const auto beyond = [&ratios](double limit) {
    const auto count = std::count_if(ratios.begin(), ratios.end(), [limit](double r) { return r > limit; });
    return static_cast<double>(count) / static_cast<double>(ratios.size());
  };
  scores.beyond_2_sigma = beyond(2.0);
  scores.beyond_3_sigma = beyond(3.0);
}

Eigen::Vector3d centre_of(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex.cast<double>());
  return box.center();
}

/// Returns the best rigid motion onto the truth.
Transform score_measured(const Mesh& model, const Truth& truth, const SurfaceIndex& surface,
                         const EvaluateOptions& options, Scores& scores) {
  const std::vector<std::uint32_t> faces = measured_faces(model, true);
  const std::vector<SurfaceSample> samples = sample_surface(model, faces, options.samples);
  const auto nearest = nearest_to(samples, surface);
  scores.measured = figures(distances(nearest), area_of(model, faces));
  score_normals(samples, nearest, truth.mesh, scores);
  score_sigma(samples, nearest, model, scores);
  const Transform motion = align(samples, truth.mesh, surface, options.alignment);
  scores.aligned = figures(distances(nearest_to(samples, surface, motion)), scores.measured.area_mm2);
  const Eigen::Vector3d centre = centre_of(truth.mesh);
  scores.alignment_deg = to_degrees(rotation_angle(motion.linear()));
  scores.alignment_mm = (motion * centre - centre).norm();
  return motion;
}

Result<void> score_coverage(const Mesh& model, const std::vector<SurfaceSample>& truth, const std::vector<int>& views,
                            Scores& scores) {
  const auto observable = std::count_if(views.begin(), views.end(), [](int n) { return n > 0; });
  scores.observable_share = static_cast<double>(observable) / static_cast<double>(views.size());
  const std::vector<std::uint32_t> faces = measured_faces(model, true);
  scores.covered_010 = scores.covered_015 = 0.0;
  if (faces.empty()) return {};
  const auto measured = SurfaceIndex::create(model, faces);
  if (!measured) return pass_on(measured);
  std::vector<double> off(truth.size());
  for_each_sample(truth.size(), [&](std::size_t i) {
    off[i] = views[i] > 0 ? measured->nearest(truth[i].point, 1.0).distance : kNoFigure;
  });
  const auto share_within = [&](double limit) {
    const auto within = std::count_if(off.begin(), off.end(), [limit](double d) { return d <= limit; });
    return static_cast<double>(within) / static_cast<double>(observable);
  };
  scores.covered_010 = share_within(0.10);
  scores.covered_015 = share_within(0.15);
  return {};
}

void score_topology(const Mesh& model, const Mesh& truth, Scores& scores) {
  const Topology found = topology(model);
  scores.vertices = model.vertices.size();
  scores.faces = model.faces.size();
  scores.components = found.components;
  scores.watertight = found.watertight();
  scores.genus = found.genus();
  const Topology wanted = topology(truth);
  if (wanted.watertight()) scores.true_genus = wanted.genus();
  scores.self_intersections = self_intersecting_faces(model).size();
}

/// Largest share of `off` in its own standard deviation, over the principal directions.
double in_sigmas(const Eigen::Vector3d& off, const Eigen::Matrix3d& covariance) {
  const PrincipalSigmas known = principal_sigmas(covariance);
  return (known.directions.transpose() * off).cwiseAbs().cwiseQuotient(known.sigma.cwiseMax(1e-12)).maxCoeff();
}

double in_sigmas(const Transform& off, const PoseUncertainty& known) {
  const Eigen::AngleAxisd turn(off.linear());
  return std::max(in_sigmas(turn.angle() * turn.axis(), known.covariance.topLeftCorner<3, 3>()),
                  in_sigmas(off * known.centre - known.centre, known.covariance.bottomRightCorner<3, 3>()));
}

/// `centre`: of the object, in the frame of both motions.
Scores::PoseError pose_error(const Transform& claimed, const Transform& truth, const Eigen::Vector3d& centre,
                             const std::optional<PoseUncertainty>& known) {
  const Transform off = claimed * truth.inverse();
  Scores::PoseError error{to_degrees(rotation_angle(off.linear())), (off * centre - centre).norm()};
  if (known) error.sigmas = in_sigmas(off, *known);
  return error;
}

void score_poses(const Claim& claim, const Truth& truth, Scores& scores) {
  const Eigen::Vector3d centre = centre_of(truth.mesh);
  if (claim.pose1_from_pose2 && truth.pose1_from_pose2) {
    scores.pose2 = pose_error(*claim.pose1_from_pose2, *truth.pose1_from_pose2, centre, claim.pose_uncertainty);
  }
  if (claim.frame_of_pose >= truth.poses.size()) return;
  const Transform& frame_from_truth = truth.poses[claim.frame_of_pose].table_from_truth;
  for (const ClaimedPose& further : claim.further_poses) {
    if (further.pose >= truth.poses.size()) continue;
    const Transform frame_from_pose = frame_from_truth * truth.poses[further.pose].table_from_truth.inverse();
    scores.further_poses.push_back({further.pose, pose_error(further.frame_from_pose, frame_from_pose,
                                                             frame_from_truth * centre, further.uncertainty)});
  }
}

/// The model in pose 1's frame, by the truth: which pose's frame it has is a convention.
TexturedMesh in_frame_of_pose1(TexturedMesh model, const Transform& truth_from_frame) {
  for (auto& vertex : model.mesh.vertices) vertex = (truth_from_frame * vertex.cast<double>()).cast<float>();
  for (auto& normal : model.mesh.normals) normal = (truth_from_frame.linear() * normal.cast<double>()).cast<float>();
  return model;
}

/// Calls `use` with every view of the truth. Fails with `stopped`.
Result<void> for_each_view(const Truth& truth, const SurfaceIndex& surface, const ObservableRule& rule,
                           const Context& context, const std::function<void(const TrueView&)>& use) {
  std::size_t done = 0, all = 0;
  for (const TruePose& pose : truth.poses) all += pose.angles_deg.size();
  for (const TruePose& pose : truth.poses) {
    for (const double angle : pose.angles_deg) {
      if (context.stopped()) return fail(ErrorCode::stopped, "evaluation stopped");
      use(TrueView(truth, surface, pose, angle, rule));
      context.report("evaluate", static_cast<double>(++done) / static_cast<double>(all));
    }
  }
  return {};
}

void count_view(const TrueView& view, const std::vector<SurfaceSample>& samples, std::vector<int>& views) {
  for_each_sample(samples.size(),
                  [&](std::size_t i) { views[i] += view.observes(samples[i].point, samples[i].normal) ? 1 : 0; });
}

Result<Scores> evaluate_in_truth_frame(const Claim& claim, const Truth& truth, const ScanFolder* photos,
                                       const EvaluateOptions& options, const Context& context) {
  const Mesh& model = claim.model.mesh;
  const auto true_surface = SurfaceIndex::create(truth.mesh);
  if (!true_surface) return pass_on(true_surface, "truth");
  const auto model_surface = SurfaceIndex::create(model);
  if (!model_surface) return pass_on(model_surface, "model");
  Scores scores;
  const Transform truth_from_model = score_measured(model, truth, *true_surface, options, scores);
  SigmaProbe probe(model, sample_surface(model, measured_faces(model, true), options.sigma_samples), truth,
                   *true_surface, truth_from_model);
  score_topology(model, truth.mesh, scores);
  score_poses(claim, truth, scores);
  const std::vector<std::uint32_t> closed = measured_faces(model, false);
  const double closed_area = area_of(model, closed);
  scores.closed_share = closed_area / (closed_area + scores.measured.area_mm2);

  std::vector<std::uint32_t> all_faces = measured_faces(model, true);
  all_faces.insert(all_faces.end(), closed.begin(), closed.end());
  const auto whole = sample_surface(model, all_faces, options.samples);
  scores.whole = figures(distances(nearest_to(whole, *true_surface)), closed_area + scores.measured.area_mm2);

  Mesh unlabelled;
  unlabelled.vertices = truth.mesh.vertices;
  unlabelled.faces = truth.mesh.faces;
  const auto truth_samples = sample_surface(unlabelled, measured_faces(unlabelled, true), options.samples);
  if (truth_samples.empty()) return fail(ErrorCode::degenerate, "truth: the mesh has no area");
  std::vector<int> views(truth_samples.size(), 0);
  std::optional<IdealCarve> carve;
  if (!closed.empty()) carve.emplace(truth.mesh, options.carve_voxel_mm);
  const auto seen = for_each_view(truth, *true_surface, options.observable, context, [&](const TrueView& view) {
    count_view(view, truth_samples, views);
    probe.see(view);
    if (carve) carve->cut(view);
  });
  if (!seen) return pass_on(seen);
  scores.sigma_classes = probe.figures();
  if (const auto covered = score_coverage(model, truth_samples, views, scores); !covered) return pass_on(covered);
  if (carve) scores.closed = figures(carve->distances(sample_surface(model, closed, options.samples)), closed_area);

  if (photos && !claim.model.corner_uv.empty()) {
    const auto texture = texture_figures(claim.model, truth, *photos, options.texture, context);
    if (!texture) return pass_on(texture);
    scores.texture = *texture;
  }
  return scores;
}

}  // namespace

std::vector<int> observable_views(const std::vector<SurfaceSample>& samples, const Truth& truth,
                                  const SurfaceIndex& surface, const ObservableRule& rule) {
  std::vector<int> views(samples.size(), 0);
  for (const TruePose& pose : truth.poses) {
    for (const double angle : pose.angles_deg) count_view({truth, surface, pose, angle, rule}, samples, views);
  }
  return views;
}

Result<Scores> evaluate(const Claim& claim, const Truth& truth, const ScanFolder* photos,
                        const EvaluateOptions& options, const Context& context) {
  if (claim.frame_of_pose > 0 && claim.frame_of_pose < truth.poses.size()) {
    Claim moved = claim;
    const Transform truth_from_frame = truth.poses[claim.frame_of_pose].table_from_truth.inverse();
    moved.model = in_frame_of_pose1(std::move(moved.model), truth_from_frame);
    return evaluate_in_truth_frame(moved, truth, photos, options, context);
  }
  return evaluate_in_truth_frame(claim, truth, photos, options, context);
}

}  // namespace scanrig
