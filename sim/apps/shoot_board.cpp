#include "sim/apps/shoot_board.h"

#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/hash.h"
#include "core/image_codec.h"
#include "sim/scene/calibration_truth.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using nlohmann::ordered_json;
namespace fs = std::filesystem;

ordered_json board_as_ordered(const CalibrationSeries& series) {
  const BoardLayout& board = series.board().layout();
  ordered_json json = {{"columns", board.columns}, {"rows", board.rows}, {"square_mm", board.square_mm}};
  if (board.marker_mm > 0.0) json["markers"] = {{"size_mm", board.marker_mm}, {"dictionary", "4x4_100"}};
  json["thickness_mm"] = board.thickness_mm;
  // Measured once, between the outermost corners of the first row and column.
  constexpr double kSigma = 0.005;  // mm
  json["lengths"] = ordered_json::array();
  const int last_column = board.corner_columns() - 1, last_row = board.corner_count() - board.corner_columns();
  for (const int to : {last_column, last_row}) {
    const double length = (series.board().corner(to) - series.board().corner(0)).norm();
    const double read = length + kSigma * normal(mix(series.options().seed, 0x6c65, to));
    json["lengths"].push_back({{"from", 0}, {"to", to}, {"mm", std::round(1e3 * read) / 1e3}, {"sigma_mm", kSigma}});
  }
  return json;
}

ordered_json camera(const Eye& eye, const SeriesOptions& options) {
  return {{"serial", eye.serial}, {"focal_px", std::round(profile().focal_px * options.image_scale)}};
}

ordered_json list_of(const CalibrationSeries& series) {
  const auto& geometry = series.rig().geometry;
  return {{"format", "scanrig-calibration-images"},
          {"version", 1},
          {"pixel_format", "BayerRG8"},
          {"exposure_us", std::lround(1e6 * profile().exposure_s)},
          {"table_radius_mm", profile().table_radius_mm},
          {"left", camera(geometry.left, series.options())},
          {"right", camera(geometry.right, series.options())},
          {"board", board_as_ordered(series)},
          {"pairs", ordered_json::array()}};
}

ordered_json sets(const SeriesPair& pair) {
  ordered_json json = ordered_json::array();
  if (pair.in_a) json.push_back("A");
  if (pair.in_b) json.push_back("B");
  return json;
}

}  // namespace

Result<void> shoot_board(const SeriesOptions& options, const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder / "calibration_truth.json", ignored)) {
    return fail(ErrorCode::exists, "shoot-board: {} holds a series already; name another folder", folder.string());
  }
  auto series = CalibrationSeries::create(options);
  if (!series) return pass_on(series);
  if (const auto made = create_directories_synced(folder); !made) return made;
  ordered_json list = list_of(**series);
  for (std::size_t i = 0; i < (*series)->pairs().size(); ++i) {
    const SeriesPair& pair = (*series)->pairs()[i];
    const StereoImages images = (*series)->shoot(i);
    const auto left = encode_png(images.left), right = encode_png(images.right);
    if (!left) return pass_on(left, "shoot-board");
    if (!right) return pass_on(right, "shoot-board");
    const std::array<FileContent, 2> files = {{{pair.name + "_left.png", *left}, {pair.name + "_right.png", *right}}};
    if (const auto written = write_files_synced(folder, files); !written) return written;
    list["pairs"].push_back({{"placement", pair.placement},
                             {"sets", sets(pair)},
                             {"table_deg", pair.reported_deg},
                             {"left", {{"path", files[0].name}, {"sha256", sha256(*left)}}},
                             {"right", {{"path", files[1].name}, {"sha256", sha256(*right)}}}});
  }
  if (const auto written = write_calibration_truth(**series, folder); !written) return written;
  if (options.hand_held > 0) return {};
  return write_file_atomically(folder / "calibration_images.json", list.dump(1) + "\n");
}

}  // namespace scanrig::sim
