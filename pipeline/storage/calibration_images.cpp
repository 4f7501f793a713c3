#include "pipeline/storage/calibration_images.h"

#include <algorithm>
#include <map>

#include "core/files.h"
#include "core/hash.h"
#include "core/image_codec.h"
#include "core/strict_json.h"
#include "core/units.h"
#include "pipeline/calibration/plan.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kList = "calibration_images.json";
constexpr const char* kScan = "scan.json";
constexpr std::array kSides = {"left", "right"};
constexpr std::array kEndings = {".png", ".jpg", ".jpeg"};

Board read_board(JsonObject object, std::vector<BoardLength>& lengths) {
  Board board;
  board.columns = object.integer("columns", 3, 1000);
  board.rows = object.integer("rows", 3, 1000);
  board.square_mm = object.number("square_mm", 0.1, 1e4);
  board.thickness_mm = object.number("thickness_mm", 0.0, 1e3);
  board.markers.reset();
  if (object.has("markers")) {
    JsonObject markers = object.object("markers");
    board.markers = BoardMarkers{markers.number("size_mm", 0.1, 1e4), markers.text("dictionary")};
    markers.close();
  }
  if (object.has("lengths")) {
    for (JsonObject& length : object.objects("lengths")) {
      const int last = std::max(0, board.corner_count() - 1);
      lengths.push_back({length.integer("from", 0, last), length.integer("to", 0, last), length.number("mm", 0.1, 1e5),
                         length.number("sigma_mm", 1e-6, 1e3)});
      length.close();
    }
  }
  object.close();
  return board;
}

RimDots read_rim_dots(JsonObject object) {
  RimDots dots;
  dots.count = object.integer("count", 3, 1000);
  dots.radius_mm = object.number("radius_mm", 1.0, 1e4);
  dots.diameter_mm = object.number("diameter_mm", 0.1, 1e3);
  object.close();
  return dots;
}

CalibrationPair read_pair(JsonObject& object, const fs::path& folder) {
  CalibrationPair pair;
  pair.placement = object.integer("placement", 1, 1000);
  pair.in_a = pair.in_b = false;
  for (const std::string& set : object.texts("sets")) {
    if (set != "A" && set != "B") object.reject("sets", "must be \"A\", \"B\" or both");
    (set == "A" ? pair.in_a : pair.in_b) = true;
  }
  if (!pair.in_a && !pair.in_b) object.reject("sets", "must not be empty");
  if (object.has("table_deg")) pair.table_deg = object.number("table_deg", -1e5, 1e5);
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    JsonObject file = object.object(kSides[side]);
    pair.files[side] = folder / file.inner_path("path");
    if (file.has("sha256")) pair.sha256[side] = file.sha256("sha256");
    file.close();
  }
  object.close();
  return pair;
}

/// Numbers the pairs within their placements, for their names.
void name_pairs(std::vector<CalibrationPair>& pairs) {
  std::map<int, int> seen;
  for (CalibrationPair& pair : pairs) {
    pair.name = fmt::format("placement {} image {}", pair.placement, ++seen[pair.placement]);
  }
}

Result<CalibrationImages> read_list(const fs::path& folder) {
  auto json = JsonFile::read(folder / kList, "scanrig-calibration-images", 1);
  if (!json) return pass_on(json);
  JsonObject& root = json->root();
  CalibrationImages images;
  images.folder = folder;
  images.pixel_format = root.one_of("pixel_format", {"Mono8", "BayerRG8", "BGR8"});
  root.ignore("exposure_us");
  if (root.has("table_radius_mm")) images.table_radius_mm = root.number("table_radius_mm", 1.0, 1e4);
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    JsonObject camera = root.object(kSides[side]);
    images.serials[side] = camera.text("serial");
    images.focal_px[side] = camera.number("focal_px", 1.0, 1e6);
    camera.close();
  }
  if (root.has("board")) images.board = read_board(root.object("board"), images.lengths);
  if (root.has("rim_dots")) images.rim_dots = read_rim_dots(root.object("rim_dots"));
  for (JsonObject& pair : root.objects("pairs")) images.pairs.push_back(read_pair(pair, folder));
  if (images.pairs.empty()) root.reject("pairs", "must not be empty");
  const auto is_mixed = [&](const CalibrationPair& pair) {
    return pair.table_deg.has_value() != images.pairs.front().table_deg.has_value();
  };
  if (std::ranges::any_of(images.pairs, is_mixed)) {
    root.reject("pairs", "must all have a table_deg, or none of them");
  }
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  name_pairs(images.pairs);
  return images;
}

/// NAME and side (0 left) of NAME_left.png and its like.
std::optional<std::pair<std::string, std::size_t>> side_of(const fs::path& file) {
  if (std::ranges::find(kEndings, file.extension().string()) == kEndings.end()) return std::nullopt;
  const std::string stem = file.stem().string();
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    const std::string end = std::string("_") + kSides[side];
    if (stem.size() > end.size() && stem.ends_with(end))
      return std::pair(stem.substr(0, stem.size() - end.size()), side);
  }
  return std::nullopt;
}

Result<CalibrationImages> read_names(const fs::path& folder) {
  std::error_code trouble;
  fs::directory_iterator entries(folder, trouble);
  if (trouble) {
    const auto code = fs::exists(folder) ? ErrorCode::io : ErrorCode::not_found;
    return fail(code, "{}: cannot be read: {}", folder.string(), trouble.message());
  }
  std::map<std::string, std::array<fs::path, 2>> by_name;
  for (const auto& entry : entries) {
    if (const auto found = side_of(entry.path())) by_name[found->first][found->second] = entry.path();
  }
  CalibrationImages images;
  images.folder = folder;
  for (const auto& [name, files] : by_name) {
    for (std::size_t side = 0; side < kSides.size(); ++side) {
      if (!files[side].empty()) continue;
      return fail(ErrorCode::not_found, "{}: has no partner {}_{}; add it, or remove the file",
                  files[1 - side].string(), name, kSides[side]);
    }
    CalibrationPair pair{.name = name, .placement = static_cast<int>(images.pairs.size()) + 1};
    pair.files = files;
    images.pairs.push_back(pair);
  }
  if (images.pairs.empty()) {
    return fail(ErrorCode::not_found, "{}: no {} and no NAME_left.png with NAME_right.png; name a folder of images",
                folder.string(), kList);
  }
  return images;
}

Result<CalibrationImages> read_job(const fs::path& folder) {
  const auto manifest = read_manifest(folder / kScan);
  if (!manifest) return pass_on(manifest);
  if (manifest->source != "calibration") {
    return fail(ErrorCode::invalid_input, "{}: is not a calibration; name the folder of a calibration job",
                (folder / kScan).string());
  }
  if (manifest->poses.size() > calibration_plan().size()) {
    return fail(ErrorCode::invalid_input, "{}: has {} placements, a calibration at most {}", (folder / kScan).string(),
                manifest->poses.size(), calibration_plan().size());
  }
  CalibrationImages images;
  images.folder = folder;
  for (std::size_t pose = 0; pose < manifest->poses.size(); ++pose) {
    for (const ViewRecord& view : manifest->poses[pose].views) {
      images.pixel_format = view.pixel_format;
      images.pairs.push_back(calibration_pair(folder, pose, view));
    }
  }
  if (images.pairs.empty()) return fail(ErrorCode::not_found, "{}: has no views yet", (folder / kScan).string());
  // The calibration that the rig had then is of the same cameras; the rig's first one is solved without.
  if (!manifest->calibration) return images;
  if (const auto had = read_calibration(folder / manifest->calibration->path)) {
    images.serials = {had->left.serial, had->right.serial};
    images.table_radius_mm = had->table_radius_mm;
  }
  return images;
}

}  // namespace

CalibrationPair calibration_pair(const fs::path& folder, std::size_t pose, const ViewRecord& view) {
  const Placement& placement = calibration_plan().at(pose);
  CalibrationPair pair{.name = fmt::format("placement {} image {}", placement.number, view.index + 1),
                       .placement = placement.number,
                       .in_a = placement.in_a,
                       .in_b = placement.in_b,
                       .table_deg = view.measured_deg};
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    const auto file = view.files.find(fmt::format("{}_plain", kSides[side]));
    if (file == view.files.end()) continue;
    pair.files[side] = folder / file->second.path;
    pair.sha256[side] = file->second.sha256;
  }
  return pair;
}

Result<CalibrationImages> read_calibration_images(const fs::path& folder) {
  if (fs::exists(folder / kList)) return read_list(folder);
  return fs::exists(folder / kScan) ? read_job(folder) : read_names(folder);
}

Result<cv::Mat> load_calibration_image(const CalibrationPair& pair, std::size_t side) {
  const auto& file = pair.files.at(side);
  const auto bytes = read_file(file);
  if (!bytes) return pass_on(bytes);
  if (!pair.sha256[side].empty() && sha256(*bytes) != pair.sha256[side]) {
    return fail(ErrorCode::invalid_input, "{}: is another file than the one listed: its hash differs; take it again",
                file.string());
  }
  auto image = file.extension() == ".png" ? decode_png(*bytes) : decode_jpeg(*bytes);
  if (!image) return pass_on(image, file.string());
  return image;
}

}  // namespace scanrig
