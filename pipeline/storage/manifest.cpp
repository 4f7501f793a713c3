#include "pipeline/storage/manifest.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "core/strict_json.h"
#include "pipeline/storage/transform_json.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

constexpr int kVersion = 6;             ///< 4 had no calibrations, 5 one exposure of the pattern a view
constexpr int kCurrentKeysVersion = 4;  ///< older versions use old names of two keys
constexpr std::array kStates = {"queued",    "scanning", "waiting_for_flip", "scanned", "interrupted",
                                "cancelled", "failed"};
constexpr std::array kSources = {"stereo", "calibration", "range"};

/// The path of a view's file is under "path", that of the calibration under "file".
ordered_json to_json(const FileRecord& file, const char* key = "path") {
  return {{key, file.path}, {"sha256", file.sha256}};
}

/// Writes no key without retakes.
void add_retake_reasons(ordered_json& json, const std::vector<Error>& retake_reasons) {
  for (const Error& why : retake_reasons)
    json["retake_reasons"].push_back({{"code", to_string(why.code)}, {"message", why.message}});
}

ordered_json to_json(const ViewRecord& view) {
  ordered_json files = ordered_json::object();
  for (const auto& [role, file] : view.files) files[role] = to_json(file);
  ordered_json json = {{"index", view.index},
                       {"commanded_deg", view.commanded_deg},
                       {"measured_deg", view.measured_deg},
                       {"moving_ms", view.moving_ms},
                       {"settling_ms", view.settling_ms},
                       {"taken", view.taken},
                       {"pixel_format", view.pixel_format},
                       {"files", files}};
  if (!view.pattern_factors.empty()) json["pattern_factors"] = view.pattern_factors;
  add_retake_reasons(json, view.retake_reasons);
  if (view.grid) {
    json["grid"] = {{"fx", view.grid->fx}, {"fy", view.grid->fy}, {"cx", view.grid->cx}, {"cy", view.grid->cy}};
    json["camera_from_pose"] = transform_json(view.camera_from_pose);
  }
  return json;
}

ordered_json to_json(const MovementCheckRecord& movement_check) {
  ordered_json json = {{"after_views", movement_check.after_views},
                       {"measured_deg", movement_check.measured_deg},
                       {"taken", movement_check.taken},
                       {"shift_px", movement_check.shift_px},
                       {"changed", movement_check.changed},
                       {"unmoved", movement_check.unmoved}};
  add_retake_reasons(json, movement_check.retake_reasons);
  return json;
}

FileRecord read_file_record(JsonObject object, std::string_view key = "path") {
  FileRecord file{object.inner_path(key), object.sha256("sha256")};
  object.close();
  return file;
}

Projection read_grid(JsonObject object) {
  Projection grid;
  grid.kind = Projection::Kind::orthographic;
  grid.fx = object.number("fx", 1e-6, 1e6);
  grid.fy = object.number("fy", 1e-6, 1e6);
  grid.cx = object.number("cx", -1e6, 1e6);
  grid.cy = object.number("cy", -1e6, 1e6);
  object.close();
  return grid;
}

Error read_error(JsonObject object) {
  const auto code = parse_error_code(object.text("code"));
  if (!code) object.reject("code", "is not an error code of this program");
  Error error{code.value_or(ErrorCode::internal), object.text("message")};
  object.close();
  return error;
}

std::vector<Error> read_retake_reasons(JsonObject& object, int version) {
  const char* const key = version >= kCurrentKeysVersion ? "retake_reasons" : "spoilt";  // old name
  std::vector<Error> reasons;
  if (!object.has(key)) return reasons;
  for (const JsonObject& why : object.objects(key)) reasons.push_back(read_error(why));
  return reasons;
}

/// The first exposure, of factor 1, is not among them.
std::vector<double> read_pattern_factors(JsonObject& object) {
  if (!object.has("pattern_factors")) return {};
  std::vector<double> factors = object.numbers("pattern_factors");
  std::set<double> known{1.0};
  for (const double factor : factors) {
    if (factor >= kMinPatternFactor && factor <= kMaxPatternFactor && known.insert(factor).second) continue;
    object.reject("pattern_factors", fmt::format("must be different numbers from {:g} to {:g}, without 1",
                                                 kMinPatternFactor, kMaxPatternFactor));
  }
  return factors;
}

ViewRecord read_view(JsonObject object, const std::string& source, int version) {
  ViewRecord view;
  view.index = object.integer("index", 0, 9999);
  view.commanded_deg = object.number("commanded_deg", -3600, 3600);
  view.measured_deg = object.number("measured_deg", -3600, 3600);
  view.moving_ms = object.number("moving_ms", 0);
  view.settling_ms = object.number("settling_ms", 0);
  view.taken = object.text("taken");
  const bool images = source != "range";
  view.pixel_format =
      images ? object.one_of("pixel_format", {"Mono8", "BayerRG8", "BGR8"}) : object.one_of("pixel_format", {""});
  JsonObject files = object.object("files");
  for (const std::string& role : view_roles(source)) view.files[role] = read_file_record(files.object(role));
  if (source == "stereo") view.pattern_factors = read_pattern_factors(object);
  for (const double factor : view.pattern_factors) {
    for (const std::string& role : pattern_roles(factor)) view.files[role] = read_file_record(files.object(role));
  }
  files.close();
  view.retake_reasons = read_retake_reasons(object, version);
  if (!images) {
    view.grid = read_grid(object.object("grid"));
    view.camera_from_pose = object.transform("camera_from_pose");
  }
  object.close();
  return view;
}

MovementCheckRecord read_movement_check(JsonObject object, int version) {
  MovementCheckRecord movement_check;
  movement_check.after_views = object.integer("after_views", 0, 9999);
  movement_check.measured_deg = object.number("measured_deg", -3600, 3600);
  movement_check.taken = object.text("taken");
  movement_check.shift_px = object.number("shift_px", 0, 1e6);
  movement_check.changed = object.number("changed", 0, 1);
  movement_check.unmoved = object.flag("unmoved");
  movement_check.retake_reasons = read_retake_reasons(object, version);
  object.close();
  return movement_check;
}

/// The first missing index before the last one (0 without views).
std::optional<int> first_gap(const PoseRecord& pose) {
  if (pose.views.empty()) return 0;
  for (int i = 0; i < static_cast<int>(pose.views.size()); ++i) {
    if (pose.views[static_cast<std::size_t>(i)].index != i) return i;
  }
  return std::nullopt;
}

PoseRecord read_pose(JsonObject object, const std::string& source, int version) {
  PoseRecord pose;
  pose.name = object.text("name");
  if (pose.name.empty() || pose.name.front() == '.' || pose.name.find('/') != std::string::npos) {
    object.reject("name", fmt::format("\"{}\" is not a valid folder name", pose.name));
  }
  pose.complete = object.flag("complete");
  for (JsonObject& view : object.objects("views")) {
    pose.views.push_back(read_view(view, source, version));
    if (pose.views.size() > 1 && pose.views.back().index <= pose.views[pose.views.size() - 2].index) {
      view.reject("index", "views must be listed by ascending index, each once");
    }
  }
  if (version >= 2) {
    const char* const key = version >= kCurrentKeysVersion ? "movement_checks" : "closures";  // old name
    for (const JsonObject& check : object.objects(key))
      pose.movement_checks.push_back(read_movement_check(check, version));
  }
  if (const auto gap = first_gap(pose); pose.complete && gap) {
    object.reject("views", fmt::format("view {} is missing, though the pose is complete", *gap));
  }
  object.close();
  return pose;
}

}  // namespace

std::string to_json(const Manifest& manifest) {
  ordered_json json = {{"format", "scanrig-scan"},    {"version", kVersion},
                       {"id", manifest.id},           {"created", manifest.created},
                       {"state", manifest.state},     {"source", manifest.source},
                       {"profile", manifest.profile}, {"config_sha256", manifest.config_sha256}};
  if (manifest.calibration) json["calibration"] = to_json(*manifest.calibration, "file");
  json["poses"] = ordered_json::array();
  for (const PoseRecord& pose : manifest.poses) {
    ordered_json views = ordered_json::array();
    for (const ViewRecord& view : pose.views) views.push_back(to_json(view));
    ordered_json movement_checks = ordered_json::array();
    for (const MovementCheckRecord& movement_check : pose.movement_checks)
      movement_checks.push_back(to_json(movement_check));
    json["poses"].push_back(
        {{"name", pose.name}, {"complete", pose.complete}, {"views", views}, {"movement_checks", movement_checks}});
  }
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Result<Manifest> read_manifest(const std::filesystem::path& file) {
  auto json = JsonFile::read(file, "scanrig-scan", kVersion, 1);
  if (!json) return pass_on(json);
  JsonObject& root = json->root();
  Manifest manifest;
  manifest.id = root.text("id");
  manifest.created = root.text("created");
  manifest.state = root.text("state");
  manifest.source = root.text("source");
  manifest.profile = root.text("profile");
  if (json->version() >= 3) manifest.config_sha256 = root.sha256s("config_sha256");
  if (const auto words = check_words(manifest); !words) root.reject("", words.error().message);
  if (root.has("calibration")) manifest.calibration = read_file_record(root.object("calibration"), "file");
  std::set<std::string> names;
  for (JsonObject& pose : root.objects("poses")) {
    manifest.poses.push_back(read_pose(pose, manifest.source, json->version()));
    if (!names.insert(manifest.poses.back().name).second) pose.reject("name", "is already used by another pose");
  }
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  return manifest;
}

std::vector<std::string> view_roles(std::string_view source) {
  if (source == "range") return {"range"};
  if (source == "calibration") return {"left_plain", "right_plain"};
  return {"left_pattern", "right_pattern", "left_plain", "right_plain"};
}

std::array<std::string, 2> pattern_roles(double factor) {
  return {fmt::format("left_pattern_x{:g}", factor), fmt::format("right_pattern_x{:g}", factor)};
}

Result<void> check_words(const Manifest& manifest) {
  if (std::find(kStates.begin(), kStates.end(), manifest.state) == kStates.end()) {
    return fail(ErrorCode::invalid_input, "state: \"{}\" is not one of: {}", manifest.state, fmt::join(kStates, ", "));
  }
  if (std::find(kSources.begin(), kSources.end(), manifest.source) == kSources.end()) {
    return fail(ErrorCode::invalid_input, "source: \"{}\" is not one of: {}", manifest.source,
                fmt::join(kSources, ", "));
  }
  return {};
}

}  // namespace scanrig
