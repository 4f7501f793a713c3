#include "tests/bench/pose/campaign_judge.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <utility>

#include "core/statistics.h"
#include "core/units.h"

namespace scanrig::campaign {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

constexpr std::size_t kTruthSamples = 3000;

/// Error of each principal coordinate, weakest first, and its own sigma.
json by_direction(const Vector3d& error, const Eigen::Matrix3d& covariance, double unit) {
  const PrincipalSigmas principal = principal_sigmas(covariance);
  json all = json::array();
  for (int k = 0; k < 3; ++k) {
    all.push_back({{"error", unit * principal.directions.col(k).dot(error)}, {"sigma", unit * principal.sigma[k]}});
  }
  return all;
}

}  // namespace

Result<Truth> truth_of(const Mesh& mesh) {
  auto surface = SurfaceIndex::create(mesh);
  if (!surface) return pass_on(surface);
  const auto properties = solid_properties(mesh);
  if (!properties) return pass_on(properties);
  StableRestOptions exact;
  exact.dilation_mm = exact.dilation = 0.0;
  auto rests = rests_on_hull(mesh, *properties, 0.0, exact);
  if (!rests) return pass_on(rests);
  return Truth{mesh, std::move(*surface), *properties, std::move(rests->rests), samples_of(mesh, kTruthSamples), {},
               {}};
}

std::vector<SurfaceSample> samples_of(const Mesh& mesh, std::size_t count) {
  std::vector<std::uint32_t> faces(mesh.faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) faces[f] = f;
  return sample_surface(mesh, faces, count);
}

SurfaceError surface_error(const Truth& truth, const Transform& pose1_from_pose2) {
  const Transform object_from_object = truth.pose1_from_object.inverse() * pose1_from_pose2 * truth.pose2_from_object;
  std::vector<double> distances;
  for (const SurfaceSample& sample : truth.samples) {
    distances.push_back(truth.surface.nearest(object_from_object * sample.point).distance);
  }
  return {quantile(distances, 0.5), quantile(distances, 0.95), quantile(distances, 1.0)};
}

Transform as_measured(const std::vector<View>& views, const std::vector<Mark>& marks) {
  std::vector<std::pair<Vector3d, Vector3d>> pairs;  // true, as measured
  for (const View& view : views) {
    const Transform pose_from_camera = view.range.camera_from_pose.inverse();
    for (const Mark& mark : marks) {
      if (mark.view == view.index) pairs.emplace_back(mark.in_pose, pose_from_camera * mark.in_camera);
    }
  }
  Eigen::Matrix3Xd real(3, pairs.size()), measured(3, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    real.col(static_cast<Eigen::Index>(i)) = pairs[i].first;
    measured.col(static_cast<Eigen::Index>(i)) = pairs[i].second;
  }
  Transform fitted = Transform::Identity();
  fitted.matrix() = Eigen::umeyama(real, measured, false);
  return fitted;
}

json judged(const Truth& truth, const Transform& measured_from_true1, const Transform& measured_from_true2,
            const RefinedPose& refined, bool is_symmetric) {
  const Transform right = measured_from_true1 * truth.pose1_from_pose2() * measured_from_true2.inverse();
  const Transform off = refined.pose1_from_pose2 * right.inverse();
  const Transform off_table = refined.pose1_from_pose2 * truth.pose1_from_pose2().inverse();
  const Eigen::AngleAxisd turn(off.linear());
  const Vector3d rotation = turn.angle() * turn.axis(), shift = off * refined.centre - refined.centre;
  const SurfaceError surface =
      surface_error(truth, measured_from_true1.inverse() * refined.pose1_from_pose2 * measured_from_true2);
  const SurfaceError on_table = surface_error(truth, refined.pose1_from_pose2);
  const Vector3d middle = truth.pose1_from_object * truth.properties.centre_of_mass;
  json result = {{"rotation_deg", to_degrees(turn.angle())},
                 {"translation_mm", (off * middle - middle).norm()},
                 {"surface_mm", {surface.median_mm, surface.p95_mm, surface.max_mm}},
                 {"surface_on_table_mm", {on_table.median_mm, on_table.p95_mm, on_table.max_mm}},
                 {"on_table", {to_degrees(rotation_angle(off_table.linear())), (off_table * middle - middle).norm()}},
                 {"condition", refined.condition},
                 {"median_mm", refined.median_mm},
                 {"refined_overlap", refined.overlap}};
  if (is_symmetric) return result;
  result["rotation"] = by_direction(rotation, refined.covariance.topLeftCorner<3, 3>(), to_degrees(1.0));
  result["translation"] = by_direction(shift, refined.covariance.bottomRightCorner<3, 3>(), 1.0);
  return result;
}

json judged(const Truth& truth, const Candidate& c) {
  return {{"generator", c.generator},
          {"confirmed", c.agreement.confirmed},
          {"contradicted", c.agreement.contradicted},
          {"median_mm", c.agreement.median_mm},
          {"separable", c.separable},
          {"off_deg",
           to_degrees(rotation_angle(c.pose1_from_pose2.linear().transpose() * truth.pose1_from_pose2().linear()))},
          {"surface_max_mm", surface_error(truth, c.pose1_from_pose2).max_mm}};
}

}  // namespace scanrig::campaign
