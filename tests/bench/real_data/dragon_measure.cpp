#include "tests/bench/real_data/dragon_measure.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "core/units.h"
#include "pipeline/importers/grid_resampling.h"
#include "pipeline/importers/stanford_files.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig::bench {
namespace {

constexpr std::size_t kSamples = 100'000;
constexpr float kMmPerMetre = 1000.0F;

/// Turntable frame of the imported pose, in the world of the .conf: through the first scan, which is in both.
/// The last scan must give the same result, or the folder was made from other data.
Result<Transform> turntable_from_world(const std::filesystem::path& conf, const PoseRecord& pose) {
  const auto scans = read_stanford_conf(conf);
  if (!scans) return pass_on(scans);
  if (scans->size() != pose.views.size()) {
    return fail(ErrorCode::invalid_input, "{}: {} scans, but the scan folder's pose \"{}\" has {} views", conf.string(),
                scans->size(), pose.name, pose.views.size());
  }
  std::vector<Transform> found;
  for (const std::size_t i : {std::size_t{0}, scans->size() - 1}) {
    const auto grid = read_range_grid((*scans)[i].file);
    if (!grid) return pass_on(grid);
    const auto camera = resample(*grid);
    if (!camera) return pass_on(camera, (*scans)[i].file.string());
    found.push_back(pose.views[i].camera_from_pose.inverse() * camera->camera_from_scan *
                    (*scans)[i].world_from_scan.inverse());
  }
  if (!found.front().isApprox(found.back(), 1e-6)) {
    return fail(ErrorCode::invalid_input, "{}: the scan folder's views are not placed as these scans are",
                conf.string());
  }
  return found.front();
}

Result<Mesh> merged_mesh(const std::filesystem::path& file) {
  auto mesh = read_obj(file);
  if (!mesh) return pass_on(mesh);
  for (auto& v : mesh->vertices) v *= kMmPerMetre;
  return mesh;
}

double quantile(std::vector<double>& values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

std::vector<std::uint32_t> all_faces(const Mesh& mesh) {
  std::vector<std::uint32_t> faces(mesh.faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = static_cast<std::uint32_t>(i);
  return faces;
}

Eigen::Vector3d centre_of_area(const Mesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const auto samples = sample_surface(mesh, all_faces(mesh), kSamples);
  for (const auto& s : samples) sum += s.point;
  return sum / static_cast<double>(samples.size());
}

}  // namespace

Result<DragonMeasure> measure_dragon(const std::filesystem::path& data, const ScanFolder& scan, const Mesh& model,
                                     const std::optional<Transform>& pose1_from_pose2) {
  const auto& poses = scan.manifest().poses;
  const auto merged = merged_mesh(data / "recon/dragon_vrip_res4.obj");
  if (!merged) return pass_on(merged);
  const auto surface = SurfaceIndex::create(*merged);
  if (!surface) return pass_on(surface);
  const auto pose1_from_world = turntable_from_world(data / "stand/dragonStandRight.conf", poses.at(0));
  if (!pose1_from_world) return pass_on(pose1_from_world);

  DragonMeasure result;
  const auto measured = measured_faces(model, true);
  result.measured_area_mm2 = area_of(model, measured);
  result.measured_share = result.measured_area_mm2 / area_of(model, all_faces(model));
  const Transform world_from_pose1 = pose1_from_world->inverse();
  std::vector<double> distances;
  for (const auto& s : sample_surface(model, measured, kSamples)) {
    distances.push_back(surface->nearest(world_from_pose1 * s.point).distance);
  }
  if (distances.empty()) return fail(ErrorCode::degenerate, "the model has no measured area");
  result.median_mm = quantile(distances, 0.5);
  result.p95_mm = quantile(distances, 0.95);

  if (poses.size() < 2 || !pose1_from_pose2) return result;
  const auto pose2_from_world = turntable_from_world(data / "side/dragonSideRight_ESTIMATED.conf", poses[1]);
  if (!pose2_from_world) return pass_on(pose2_from_world);
  const Transform given = *pose1_from_world * pose2_from_world->inverse();
  const Eigen::Vector3d centre_in_pose2 = *pose2_from_world * centre_of_area(*merged);
  result.pose2 = {to_degrees(Eigen::AngleAxisd(pose1_from_pose2->linear() * given.linear().transpose()).angle()),
                  (*pose1_from_pose2 * centre_in_pose2 - given * centre_in_pose2).norm()};
  return result;
}

}  // namespace scanrig::bench
