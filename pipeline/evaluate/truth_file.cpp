#include "pipeline/evaluate/truth_file.h"

#include "core/strict_json.h"
#include "pipeline/model_io/mesh_reader.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig {

Result<Truth> read_truth(const std::filesystem::path& scan_folder) {
  auto json = JsonFile::read(scan_folder / "truth.json", "scanrig-truth", 1);
  if (!json) return pass_on(json);
  JsonObject& root = json->root();
  Truth truth;
  truth.profile_sha256 = root.text("profile_sha256");
  truth.object = root.text("object");
  root.ignore("seed");
  const std::string mesh_file = root.inner_path("mesh");
  truth.left = read_camera(root.object("left"));
  truth.right = read_camera(root.object("right"));
  JsonObject projector = root.object("projector");
  read_pinhole(projector);
  truth.projector_from_turntable = projector.transform("projector_from_turntable");
  projector.close();
  truth.table_radius_mm = root.number("table_radius_mm", 1.0, 1e4);
  for (JsonObject& pose : root.objects("poses")) {
    truth.poses.push_back({pose.transform("table_from_truth"), pose.numbers("angles_deg")});
    pose.close();
  }
  if (root.has("pose1_from_pose2")) truth.pose1_from_pose2 = root.transform("pose1_from_pose2");
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  auto mesh = read_ply(scan_folder / mesh_file);
  if (!mesh) return pass_on(mesh);
  truth.mesh = std::move(*mesh);
  return truth;
}

}  // namespace scanrig
