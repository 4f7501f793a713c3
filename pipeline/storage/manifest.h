#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Limits of ViewRecord::pattern_factors.
inline constexpr double kMinPatternFactor = 1.0 / 64.0, kMaxPatternFactor = 64.0;

/// The manifest of docs/reference/scan-folder.md.
struct FileRecord {
  std::string path;  ///< relative to the scan folder
  std::string sha256;
};

struct ViewRecord {
  int index = 0;
  double commanded_deg = 0.0;
  double measured_deg = 0.0;
  double moving_ms = 0.0;
  double settling_ms = 0.0;
  std::string taken{};         ///< ISO 8601
  std::string pixel_format{};  ///< "Mono8", "BayerRG8", "BGR8"; empty for range scans
  /// Of the exposures of the pattern besides the first: how many times its duration each lasted.
  std::vector<double> pattern_factors{};
  std::map<std::string, FileRecord> files{};
  std::vector<Error> retake_reasons{};                 ///< reasons of the retakes of its exposures
  std::optional<Projection> grid{};                    ///< range scans: orthographic
  Transform camera_from_pose = Transform::Identity();  ///< range scans only
};

/// Movement check: view 0 taken again; shows whether the views since belong together.
struct MovementCheckRecord {
  int after_views = 0;  ///< number of views of the pose at that time
  double measured_deg = 0.0;
  std::string taken{};    ///< ISO 8601
  double shift_px = 0.0;  ///< as measured by pipeline/movement, the larger of both cameras
  double changed = 0.0;   ///< 0 to 1
  bool unmoved = true;
  std::vector<Error> retake_reasons{};  ///< reasons of the retakes of its exposures
};

struct PoseRecord {
  std::string name;
  bool complete = false;
  std::vector<ViewRecord> views;  ///< by ascending index
  std::vector<MovementCheckRecord> movement_checks{};
};

struct Manifest {
  std::string id;
  std::string created;
  std::string state = "scanning";
  std::string source = "stereo";  ///< or "calibration", "range"
  std::string profile;
  std::vector<std::string> config_sha256;  ///< one per configuration that its views were taken under, in order of use
  std::optional<FileRecord> calibration;
  std::vector<PoseRecord> poses;
};

/// The text of scan.json.
std::string to_json(const Manifest& manifest);

/// Reads version 1 too, which has no movement_checks, and version 2, which has no configuration; the written version is
/// 6. Fails with `not_found`, `io`, `invalid_input` (naming file and key), `unsupported` (version). Sizes of range
/// grids are those of their files and stay 0 here.
Result<Manifest> read_manifest(const std::filesystem::path& file);

/// The files that every view of this source has: "left_plain" and so on.
std::vector<std::string> view_roles(std::string_view source);

/// The files of one more exposure of the pattern, left and right: "left_pattern_x8" lasted 8 times as long.
std::array<std::string, 2> pattern_roles(double factor);

/// Checks that `state` and `source` are words of the format. Fails with `invalid_input`.
Result<void> check_words(const Manifest& manifest);

}  // namespace scanrig
