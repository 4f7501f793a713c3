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

/// The manifest of docs/scan-folder.md.
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
  std::string taken;         ///< ISO 8601
  std::string pixel_format;  ///< "Mono8", "BayerRG8", "BGR8"; empty for range scans
  std::map<std::string, FileRecord> files;
  std::optional<Projection> grid;                      ///< range scans: orthographic
  Transform camera_from_pose = Transform::Identity();  ///< range scans only
};

struct PoseRecord {
  std::string name;
  bool complete = false;
  std::vector<ViewRecord> views;  ///< by ascending index
};

struct Manifest {
  std::string id;
  std::string created;
  std::string state = "scanning";
  std::string source = "stereo";
  std::string profile;
  std::optional<FileRecord> calibration;
  std::vector<PoseRecord> poses;
};

/// The text of scan.json.
std::string to_json(const Manifest& manifest);

/// Fails with `not_found`, `io`, `invalid_input` (naming file and key), `unsupported` (version). Sizes of range grids
/// are those of their files and stay 0 here.
Result<Manifest> read_manifest(const std::filesystem::path& file);

/// Whether the words `state` and `source` are ones the format knows. Fails with `invalid_input`.
Result<void> check_words(const Manifest& manifest);

}  // namespace scanrig
