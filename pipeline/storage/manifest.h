#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

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
  std::map<std::string, FileRecord> files{};
  std::vector<Error> retake_reasons{};                 ///< exposures that were taken again, and why
  std::optional<Projection> grid{};                    ///< range scans: orthographic
  Transform camera_from_pose = Transform::Identity();  ///< range scans only
};

/// View 0 taken again: whether the views since belong together.
struct MovementCheckRecord {
  int after_views = 0;  ///< views the pose had then
  double measured_deg = 0.0;
  std::string taken{};    ///< ISO 8601
  double shift_px = 0.0;  ///< as pipeline/movement check measures it, the worse of both cameras
  double changed = 0.0;   ///< 0 to 1
  bool unmoved = true;
  std::vector<Error> retake_reasons{};  ///< exposures that were taken again, and why
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
  std::string source = "stereo";
  std::string profile;
  std::vector<std::string> config_sha256;  ///< of each configuration its views were taken under, in order of use
  std::optional<FileRecord> calibration;
  std::vector<PoseRecord> poses;
};

/// The text of scan.json.
std::string to_json(const Manifest& manifest);

/// Reads version 1 too, which knew no movement_checks, and version 2, which knew no configuration; what is written is
/// version 3. Fails with `not_found`, `io`, `invalid_input` (naming file and key), `unsupported` (version). Sizes of
/// range grids are those of their files and stay 0 here.
Result<Manifest> read_manifest(const std::filesystem::path& file);

/// Whether the words `state` and `source` are ones the format knows. Fails with `invalid_input`.
Result<void> check_words(const Manifest& manifest);

}  // namespace scanrig
