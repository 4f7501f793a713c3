#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "core/result.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/range/range_image.h"
#include "pipeline/storage/calibration_file.h"
#include "pipeline/storage/images.h"
#include "pipeline/storage/manifest.h"

namespace scanrig {

/// A scan on disk, docs/reference/scan-folder.md. A pose and a view are identified by their positions in the manifest,
/// from 0. Threads: one user at a time; the const functions may be called from several.
class ScanFolder {
 public:
  /// Makes the folder (which must be missing or empty) with its manifest and a copy of the calibration file (empty
  /// path: none), which is checked. Fails with `exists`, `io`, and as read_calibration().
  static Result<ScanFolder> create(const std::filesystem::path& folder, Manifest manifest,
                                   const std::filesystem::path& calibration_file);

  /// Opens and checks that every named file exists. Files that the manifest does not name are ignored: a crash may
  /// leave some. Fails with `not_found`, `invalid_input` (naming file and key), `unsupported` (a newer version).
  static Result<ScanFolder> open(const std::filesystem::path& folder);

  [[nodiscard]] const Manifest& manifest() const { return manifest_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Sets the configuration of views added to this object from now on; it enters the manifest with the next of them.
  /// Empty: no configuration.
  void taken_under(std::string config_sha256) { config_sha256_ = std::move(config_sha256); }

  /// Writes the images, syncs, then the manifest: after the return the view survives a power cut; before, the folder is
  /// unchanged. Fills in `record.files` and `record.pixel_format`. Replaces a view of the same index; `pose` may be one
  /// past the last: a new pose. Fails with `invalid_input`, `io`.
  Result<void> add_view(std::size_t pose, ViewRecord record, const RawView& images);
  /// The same for an imported range scan; `depth` in mm, NaN where unknown.
  Result<void> add_range_view(std::size_t pose, ViewRecord record, const cv::Mat1f& depth);

  /// Marks the pose complete; `state` is the scan's from then on.
  Result<void> complete_pose(std::size_t pose, std::string state);
  /// Takes the views and movement checks of an incomplete pose off the manifest; `state` is the scan's from then on.
  Result<void> drop_views(std::size_t pose, std::string state);
  /// Takes the last pose off the manifest; it is incomplete. `state` is the scan's from then on.
  Result<void> drop_pose(std::string state);
  Result<void> add_movement_check(std::size_t pose, MovementCheckRecord record);
  Result<void> set_state(std::string state);

  /// Fails with `not_found`, `invalid_input` (unreadable, truncated, wrong size, hash differs), naming the file.
  [[nodiscard]] Result<RawView> load_raw(std::size_t pose, std::size_t view) const;
  [[nodiscard]] Result<ViewImages> load_images(std::size_t pose, std::size_t view) const;
  /// One image of a stereo view, ready for use; `role` as in RawView ("left_plain"). The others are not
  /// read. Fails as load_raw().
  [[nodiscard]] Result<cv::Mat> load_usable_image(std::size_t pose, std::size_t view, const std::string& role) const;
  /// A `range` view as a range image: sigma and normals filled from the depth grid.
  [[nodiscard]] Result<RangeImage> load_range(std::size_t pose, std::size_t view) const;
  /// The scan's calibration. The file is read and checked at the first call only.
  [[nodiscard]] Result<Calibration> load_calibration() const;

 private:
  /// The calibration once it was read; shared by copies of the folder, whose file never changes.
  struct LoadedCalibration {
    std::mutex mutex;
    std::optional<Calibration> calibration;
  };
  using NamedImage = std::pair<std::string, std::vector<std::byte>>;  ///< role and encoded bytes

  ScanFolder(std::filesystem::path path, Manifest manifest) : path_(std::move(path)), manifest_(std::move(manifest)) {}
  [[nodiscard]] Result<void> write_manifest(const Manifest& manifest) const;
  Result<void> change_manifest(Manifest changed);
  Result<void> store_view(std::size_t pose, ViewRecord record, std::span<const NamedImage> images,
                          std::string_view extension);
  [[nodiscard]] Result<const ViewRecord*> find_view(std::size_t pose, std::size_t view) const;
  [[nodiscard]] Result<cv::Mat> load_image(const FileRecord& file) const;
  [[nodiscard]] Result<cv::Mat> load_sensor_image(const ViewRecord& record, const std::string& role) const;

  std::filesystem::path path_;
  Manifest manifest_;
  std::string config_sha256_;
  std::shared_ptr<LoadedCalibration> loaded_ = std::make_shared<LoadedCalibration>();
};

}  // namespace scanrig
