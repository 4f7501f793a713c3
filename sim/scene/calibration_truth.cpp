#include "sim/scene/calibration_truth.h"

#include <nlohmann/json.hpp>

#include "core/files.h"
#include "sim/scene/truth_json.h"

namespace scanrig::sim {
namespace {

using nlohmann::ordered_json;

ordered_json camera_at(const Eye& eye, double blur_px) {
  return {{"fx", eye.fx},
          {"fy", eye.fy},
          {"extra_blur_px", blur_px},
          {"camera_from_turntable", transform_json(eye.eye_from_turntable)}};
}

ordered_json board_json(const PrintedBoard& board) {
  ordered_json corners = ordered_json::array();
  for (int id = 0; id < board.layout().corner_count(); ++id) {
    const Eigen::Vector3d at = board.corner(id);
    corners.push_back({at.x(), at.y(), at.z()});
  }
  return {{"corners", corners}, {"thickness_mm", board.layout().thickness_mm}, {"glare", board.errors().glare != 0.0}};
}

}  // namespace

Result<void> write_calibration_truth(const CalibrationSeries& series, const std::filesystem::path& folder) {
  const auto& options = series.options();
  ordered_json json = {{"format", "scanrig-calibration-truth"}, {"version", 1}, {"seed", options.seed}};
  if (options.rig) json["rig_seed"] = options.rig->seed;
  json.update(profile_json(options.profile));
  json.update(rig_json(series.rig()));
  json["board"] = board_json(series.board());
  json["pairs"] = ordered_json::array();
  for (const SeriesPair& pair : series.pairs()) {
    json["pairs"].push_back({{"name", pair.name},
                             {"angle_deg", pair.true_deg},
                             {"table_motion", transform_json(series.table_motion(pair))},
                             {"table_from_board", transform_json(pair.table_from_board)},
                             {"left", camera_at(pair.rig.left, pair.left_blur_px)},
                             {"right", camera_at(pair.rig.right, pair.right_blur_px)}});
  }
  return write_file_atomically(folder / "calibration_truth.json", json.dump(1) + "\n");
}

}  // namespace scanrig::sim
