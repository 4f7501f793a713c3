#include "sim/scene/truth_writer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "sim/scene/profile.h"
#include "sim/scene/truth_json.h"

namespace scanrig::sim {
namespace {

using nlohmann::ordered_json;

std::string ply(const TriangleMesh& mesh, const Transform& placed) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  const auto add = [&text](const auto& value) {
    const std::size_t at = text.size();
    text.resize(at + sizeof value);
    std::memcpy(text.data() + at, &value, sizeof value);
  };
  for (const auto& v : mesh.vertices) {
    for (const float c : (placed * v).cast<float>().eval()) add(c);
  }
  for (const auto& t : mesh.triangles) {
    add(std::uint8_t{3});
    for (const std::int32_t corner : t) add(corner);
  }
  return text;
}

}  // namespace

Result<void> write_calibration(const Scene& scene, const std::filesystem::path& file) {
  const ordered_json json = {{"format", "scanrig-calibration"},       {"version", 1},
                             {"date", "2026-11-21T09:00:00Z"},        {"table_radius_mm", profile().table_radius_mm},
                             {"left", camera_json(scene.rig().left)}, {"right", camera_json(scene.rig().right)}};
  return write_file_atomically(file, json.dump(2) + "\n");
}

void ExposureHistory::exposed(double angle_deg) {
  constexpr double kSameView = 0.5;  // deg
  auto& angles = poses_.back().angles_deg;
  const auto same = [&](double other) { return std::abs(std::remainder(other - angle_deg, 360.0)) < kSameView; };
  const auto known = std::ranges::find_if(angles, same);
  if (known != angles.end()) {
    *known = angle_deg;
  } else {
    angles.push_back(angle_deg);
  }
}

void ExposureHistory::turned_over(const Scene& scene) {
  poses_.push_back({(placement() + 1) % static_cast<int>(scene.placements().size()), {}});
}

std::vector<PoseTruth> ExposureHistory::latest(const Scene& scene) const {
  std::vector<PoseTruth> taken;
  std::ranges::copy_if(poses_, std::back_inserter(taken), [](const PoseTruth& p) { return !p.angles_deg.empty(); });
  const auto poses = static_cast<std::size_t>(scene.options().poses);
  if (taken.size() > poses) taken.erase(taken.begin(), taken.end() - static_cast<std::ptrdiff_t>(poses));
  return taken;
}

Result<void> write_truth(const Scene& scene, const std::vector<PoseTruth>& poses, const std::filesystem::path& folder) {
  if (poses.empty()) return fail(ErrorCode::degenerate, "truth: no exposure has been taken yet");
  const auto table_from_object = [&](std::size_t pose) { return scene.true_placement(poses[pose].placement); };
  const Transform truth_from_object = table_from_object(0);
  ordered_json projector = lens_json(scene.rig().projector);
  projector["projector_from_turntable"] = transform_json(scene.rig().projector.eye_from_turntable);
  ordered_json json = {{"format", "scanrig-truth"},
                       {"version", 1},
                       {"profile_sha256", scene.options().profile.sha256()},
                       {"object", scene.object().name},
                       {"seed", scene.options().seed},
                       {"mesh", "truth.ply"},
                       {"left", camera_json(scene.rig().left)},
                       {"right", camera_json(scene.rig().right)},
                       {"projector", projector},
                       {"table_radius_mm", profile().table_radius_mm},
                       {"poses", ordered_json::array()}};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Transform table_from_truth =
        i == 0 ? Transform::Identity() : table_from_object(i) * truth_from_object.inverse();
    json["poses"].push_back(
        {{"table_from_truth", transform_json(table_from_truth)}, {"angles_deg", poses[i].angles_deg}});
  }
  if (poses.size() > 1)
    json["pose1_from_pose2"] = transform_json(table_from_object(0) * table_from_object(1).inverse());
  if (const auto written = write_file_atomically(folder / "truth.ply", ply(scene.object().mesh, truth_from_object));
      !written) {
    return written;
  }
  if (auto written = write_calibration(scene, folder / "truth_calibration.json"); !written) return written;
  if (scene.options().rig || !scene.options().profile.effects.is_none()) {
    ordered_json rig = {{"format", "scanrig-rig-truth"}, {"version", 1}};
    if (scene.options().rig) rig["rig_seed"] = scene.options().rig->seed;
    rig.update(profile_json(scene.options().profile));
    rig.update(rig_json(scene.drawn_rig()));
    if (const auto written = write_file_atomically(folder / "rig_truth.json", rig.dump(2) + "\n"); !written)
      return written;
  }
  return write_file_atomically(folder / "truth.json", json.dump(2) + "\n");
}

}  // namespace scanrig::sim
