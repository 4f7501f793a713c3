#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/range/range_image.h"

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
  std::vector<ViewRecord> views;
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

/// The four images of a view, as the sensors delivered them.
struct RawView {
  std::string pixel_format;
  cv::Mat left_pattern, right_pattern, left_plain, right_plain;
};

/// The four images of a view, ready for use: BGR (colour sensors, demosaiced) or grey (mono sensors), 8 bit.
struct ViewImages {
  int index = 0;
  double angle_rad = 0.0;  ///< table angle as measured
  cv::Mat left_pattern, right_pattern, left_plain, right_plain;
};

/// Demosaics where needed. Fails with `invalid_input` for a format or sizes that do not belong together.
Result<ViewImages> to_view_images(const RawView& raw, const ViewRecord& record);

Result<Calibration> read_calibration(const std::filesystem::path& file);

/// A scan on disk. Threads: one user at a time.
class ScanFolder {
 public:
  /// Makes the folder with its manifest and a copy of the calibration file (empty path: none). Fails with `exists`,
  /// `io`.
  static Result<ScanFolder> create(const std::filesystem::path& folder, Manifest manifest,
                                   const std::filesystem::path& calibration_file);

  /// Opens and checks: every named file is there. Fails with `not_found`, `invalid_input` (naming file and key),
  /// `unsupported` (a version of the format that this program does not know).
  static Result<ScanFolder> open(const std::filesystem::path& folder);

  [[nodiscard]] const Manifest& manifest() const { return manifest_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Writes the images, syncs, then the manifest: when this returns the view survives a power cut.
  /// `record.files` is filled in here. An index that is already there is replaced. Fails with `io`.
  Result<void> add_view(std::size_t pose, ViewRecord record, const RawView& images);
  /// The same for an imported range scan; `depth` in mm, NaN where unknown.
  Result<void> add_range_view(std::size_t pose, ViewRecord record, const cv::Mat1f& depth);

  Result<void> set_pose_complete(std::size_t pose);
  Result<void> set_state(std::string state);

  /// Fails with `not_found`, `invalid_input` (unreadable, truncated, wrong size, hash differs), naming the file.
  Result<RawView> load_raw(std::size_t pose, std::size_t view) const;
  Result<ViewImages> load_images(std::size_t pose, std::size_t view) const;
  /// A `range` view as a range image: sigma and normals filled from the depth grid.
  Result<RangeImage> load_range(std::size_t pose, std::size_t view) const;
  Result<Calibration> load_calibration() const;

 private:
  Result<void> write_manifest() const;
  std::filesystem::path path_;
  Manifest manifest_;
};

}  // namespace scanrig
