#include "pipeline/storage/scan_folder.h"

#include <algorithm>
#include <system_error>

#include "core/files.h"
#include "core/hash.h"
#include "core/image_codec.h"
#include "pipeline/storage/grid_surface.h"

namespace scanrig {
namespace {

constexpr const char* kManifest = "scan.json";
constexpr const char* kCalibration = "calibration.json";

std::span<const std::byte> as_span(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

/// The bytes of a file of the folder, checked against the manifest's hash.
Result<std::string> read_recorded(const std::filesystem::path& folder, const FileRecord& file) {
  auto bytes = read_file(folder / file.path);
  if (bytes && sha256(*bytes) != file.sha256) {
    return fail(ErrorCode::invalid_input,
                "{}: the file is damaged, truncated or was changed: its SHA-256 is not that of {}",
                (folder / file.path).string(), kManifest);
  }
  return bytes;
}

Result<void> check_present(const std::filesystem::path& folder, const FileRecord& file) {
  std::error_code error;
  if (std::filesystem::is_regular_file(folder / file.path, error)) return {};
  return fail(ErrorCode::not_found, "{}: the file is missing, but {} names it", (folder / file.path).string(),
              kManifest);
}

/// The view's folder, relative to the scan's. A retaken view goes to another folder than the one in the manifest, so
/// that the old view stays whole until the new manifest is written.
std::string view_folder(const PoseRecord& pose, const ViewRecord* replaced, int index) {
  const std::string name = fmt::format("{}/view{:02}", pose.name, index);
  const bool taken = replaced && replaced->files.begin()->second.path.starts_with(name + "/");
  return taken ? name + "_again" : name;
}

}  // namespace

Result<ScanFolder> ScanFolder::create(const std::filesystem::path& folder, Manifest manifest,
                                      const std::filesystem::path& calibration_file) {
  std::error_code error;
  if (std::filesystem::exists(folder, error) && !std::filesystem::is_empty(folder, error)) {
    return fail(ErrorCode::exists, "{}: already exists; name another folder or delete this one", folder.string());
  }
  if (const auto words = check_words(manifest); !words) return pass_on(words, folder.string());
  std::string calibration;
  if (!calibration_file.empty()) {
    if (const auto checked = read_calibration(calibration_file); !checked) return pass_on(checked);
    auto text = read_file(calibration_file);
    if (!text) return pass_on(text);
    calibration = std::move(*text);
    manifest.calibration = FileRecord{kCalibration, sha256(calibration)};
  }
  if (const auto made = create_directories_synced(folder); !made) return pass_on(made);
  if (manifest.calibration) {
    const FileContent content{kCalibration, as_span(calibration)};
    if (const auto written = write_files_synced(folder, {&content, 1}); !written) return pass_on(written);
  }
  ScanFolder scan(folder, std::move(manifest));
  if (const auto written = scan.write_manifest(scan.manifest_); !written) return pass_on(written);
  return scan;
}

Result<ScanFolder> ScanFolder::open(const std::filesystem::path& folder) {
  auto manifest = read_manifest(folder / kManifest);
  if (!manifest) return pass_on(manifest);
  if (manifest->calibration) {
    if (const auto there = check_present(folder, *manifest->calibration); !there) return pass_on(there);
  }
  for (const PoseRecord& pose : manifest->poses) {
    for (const ViewRecord& view : pose.views) {
      for (const auto& [role, file] : view.files) {
        if (const auto there = check_present(folder, file); !there) return pass_on(there);
      }
    }
  }
  return ScanFolder(folder, std::move(*manifest));
}

Result<void> ScanFolder::write_manifest(const Manifest& manifest) const {
  return write_file_atomically(path_ / kManifest, to_json(manifest));
}

Result<void> ScanFolder::change_manifest(Manifest changed) {
  if (auto written = write_manifest(changed); !written) return written;
  manifest_ = std::move(changed);
  return {};
}

Result<void> ScanFolder::store_view(std::size_t pose, ViewRecord record, std::span<const NamedImage> images,
                                    std::string_view extension) {
  Manifest changed = manifest_;
  if (pose == changed.poses.size()) changed.poses.push_back({fmt::format("pose{}", pose + 1), false, {}, {}});
  if (pose > changed.poses.size()) return fail(ErrorCode::invalid_input, "{}: no pose {}", path_.string(), pose + 1);
  std::vector<ViewRecord>& views = changed.poses[pose].views;
  auto place = std::lower_bound(views.begin(), views.end(), record.index,
                                [](const ViewRecord& view, int index) { return view.index < index; });
  const bool replaces = place != views.end() && place->index == record.index;
  const std::string folder = view_folder(changed.poses[pose], replaces ? &*place : nullptr, record.index);

  std::vector<FileContent> contents;
  record.files.clear();
  for (const auto& [role, bytes] : images) {
    const std::string name = fmt::format("{}{}", role, extension);
    contents.push_back({name, bytes});
    record.files[role] = {fmt::format("{}/{}", folder, name), sha256(bytes)};
  }
  if (auto made = create_directories_synced(path_ / folder); !made) return made;
  if (auto written = write_files_synced(path_ / folder, contents); !written) return written;

  auto& configs = changed.config_sha256;
  const bool listed = std::find(configs.begin(), configs.end(), config_sha256_) != configs.end();
  if (!config_sha256_.empty() && !listed) configs.push_back(config_sha256_);
  std::vector<std::filesystem::path> superseded;
  if (replaces) {
    for (const auto& [role, file] : place->files) superseded.push_back(path_ / file.path);
    *place = std::move(record);
  } else {
    views.insert(place, std::move(record));
  }
  if (auto written = change_manifest(std::move(changed)); !written) return written;
  // The manifest no longer names the old files; a failed deletion is no error.
  std::error_code ignored;
  for (const auto& file : superseded) std::filesystem::remove(file, ignored);
  if (!superseded.empty()) std::filesystem::remove(superseded.front().parent_path(), ignored);
  return {};
}

Result<void> ScanFolder::add_view(std::size_t pose, ViewRecord record, const RawView& images) {
  const std::string who = fmt::format("{}: view {}", path_.string(), record.index);
  if (manifest_.source == "range") return fail(ErrorCode::invalid_input, "{}: not a stereo scan", who);
  if (auto checked = check_images(images, manifest_.source); !checked) return pass_on(checked, who);
  std::vector<NamedImage> encoded;
  for (const auto& role : view_roles(manifest_.source)) {
    auto bytes = encode_png(images.image(role));
    if (!bytes) return pass_on(bytes, who);
    encoded.emplace_back(role, std::move(*bytes));
  }
  record.pattern_factors.clear();
  for (const PatternExposure& more : images.more_patterns) {
    record.pattern_factors.push_back(more.factor);
    const auto roles = pattern_roles(more.factor);
    for (const bool is_left : {true, false}) {
      auto bytes = encode_png(is_left ? more.left : more.right);
      if (!bytes) return pass_on(bytes, who);
      encoded.emplace_back(roles[is_left ? 0 : 1], std::move(*bytes));
    }
  }
  record.pixel_format = images.pixel_format;
  return store_view(pose, std::move(record), encoded, ".png");
}

Result<void> ScanFolder::add_range_view(std::size_t pose, ViewRecord record, const cv::Mat1f& depth) {
  const std::string who = fmt::format("{}: view {}", path_.string(), record.index);
  if (manifest_.source != "range" || !record.grid) return fail(ErrorCode::invalid_input, "{}: not a range scan", who);
  auto bytes = encode_tiff(depth);
  if (!bytes) return pass_on(bytes, who);
  record.pixel_format.clear();
  const NamedImage image{"range", std::move(*bytes)};
  return store_view(pose, std::move(record), {&image, 1}, ".tiff");
}

Result<void> ScanFolder::complete_pose(std::size_t pose, std::string state) {
  if (pose >= manifest_.poses.size()) return fail(ErrorCode::invalid_input, "{}: no pose {}", path_.string(), pose + 1);
  Manifest changed = manifest_;
  changed.poses[pose].complete = true;
  changed.state = std::move(state);
  if (auto words = check_words(changed); !words) return words;
  return change_manifest(std::move(changed));
}

Result<void> ScanFolder::drop_views(std::size_t pose, std::string state) {
  if (pose >= manifest_.poses.size()) return fail(ErrorCode::invalid_input, "{}: no pose {}", path_.string(), pose + 1);
  Manifest changed = manifest_;
  changed.poses[pose].views.clear();
  changed.poses[pose].movement_checks.clear();
  changed.state = std::move(state);
  if (auto words = check_words(changed); !words) return words;
  return change_manifest(std::move(changed));
}

Result<void> ScanFolder::drop_pose(std::string state) {
  if (manifest_.poses.empty() || manifest_.poses.back().complete) {
    return fail(ErrorCode::invalid_input, "{}: its last pose is complete", path_.string());
  }
  Manifest changed = manifest_;
  changed.poses.pop_back();
  changed.state = std::move(state);
  if (auto words = check_words(changed); !words) return words;
  return change_manifest(std::move(changed));
}

Result<void> ScanFolder::add_movement_check(std::size_t pose, MovementCheckRecord record) {
  if (pose >= manifest_.poses.size()) return fail(ErrorCode::invalid_input, "{}: no pose {}", path_.string(), pose + 1);
  Manifest changed = manifest_;
  changed.poses[pose].movement_checks.push_back(std::move(record));
  return change_manifest(std::move(changed));
}

Result<void> ScanFolder::set_state(std::string state) {
  Manifest changed = manifest_;
  changed.state = std::move(state);
  if (auto words = check_words(changed); !words) return words;
  return change_manifest(std::move(changed));
}

Result<const ViewRecord*> ScanFolder::find_view(std::size_t pose, std::size_t view) const {
  if (pose >= manifest_.poses.size() || view >= manifest_.poses[pose].views.size()) {
    return fail(ErrorCode::not_found, "{}: no view {} of pose {}", path_.string(), view, pose + 1);
  }
  return &manifest_.poses[pose].views[view];
}

Result<cv::Mat> ScanFolder::load_image(const FileRecord& file) const {
  const auto bytes = read_recorded(path_, file);
  if (!bytes) return pass_on(bytes);
  auto image = decode_image(*bytes);
  if (!image) return pass_on(image, (path_ / file.path).string());
  return image;
}

/// An image of the size that the calibration gives its camera. A calibration's images make a new one.
Result<cv::Mat> ScanFolder::load_sensor_image(const ViewRecord& record, const std::string& role) const {
  const auto found = record.files.find(role);
  if (found == record.files.end())
    return fail(ErrorCode::not_found, "{}: view {} has no image {}", path_.string(), record.index, role);
  const FileRecord& file = found->second;
  auto image = load_image(file);
  if (!image || !manifest_.calibration || manifest_.source == "calibration") return image;
  const auto calibration = load_calibration();
  if (!calibration) return pass_on(calibration);
  const Projection& p = (role.starts_with("left") ? calibration->left : calibration->right).projection;
  if (image->size() != cv::Size(p.width, p.height)) {
    return fail(ErrorCode::invalid_input, "{}: {}x{} pixels, but the calibration is for {}x{}",
                (path_ / file.path).string(), image->cols, image->rows, p.width, p.height);
  }
  return image;
}

Result<RawView> ScanFolder::load_raw(std::size_t pose, std::size_t view) const {
  const auto record = find_view(pose, view);
  if (!record) return pass_on(record);
  if (manifest_.source == "range") return fail(ErrorCode::invalid_input, "{}: not a stereo scan", path_.string());
  RawView raw{(*record)->pixel_format, {}, {}, {}, {}};
  for (const auto& role : view_roles(manifest_.source)) {
    auto loaded = load_sensor_image(**record, role);
    if (!loaded) return pass_on(loaded);
    raw.image(role) = std::move(*loaded);
  }
  for (const double factor : (*record)->pattern_factors) {
    const auto [left_role, right_role] = pattern_roles(factor);
    auto left = load_sensor_image(**record, left_role), right = load_sensor_image(**record, right_role);
    if (!left) return pass_on(left);
    if (!right) return pass_on(right);
    raw.more_patterns.push_back({factor, std::move(*left), std::move(*right)});
  }
  if (const auto checked = check_images(raw, manifest_.source); !checked) {
    return pass_on(checked, (path_ / (*record)->files.at("left_plain").path).parent_path().string());
  }
  return raw;
}

Result<cv::Mat> ScanFolder::load_usable_image(std::size_t pose, std::size_t view, const std::string& role) const {
  const auto record = find_view(pose, view);
  if (!record) return pass_on(record);
  if (manifest_.source == "range") return fail(ErrorCode::invalid_input, "{}: not a stereo scan", path_.string());
  const auto raw = load_sensor_image(**record, role);
  if (!raw) return pass_on(raw);
  const auto image = to_usable_image(*raw, (*record)->pixel_format);
  if (!image) return pass_on(image, (path_ / (*record)->files.at(role).path).string());
  return image;
}

Result<ViewImages> ScanFolder::load_images(std::size_t pose, std::size_t view) const {
  const auto raw = load_raw(pose, view);
  if (!raw) return pass_on(raw);
  return to_view_images(*raw, manifest_.poses[pose].views[view]);
}

Result<RangeImage> ScanFolder::load_range(std::size_t pose, std::size_t view) const {
  const auto record = find_view(pose, view);
  if (!record) return pass_on(record);
  if (manifest_.source != "range") return fail(ErrorCode::invalid_input, "{}: not a range scan", path_.string());
  const FileRecord& file = (*record)->files.at("range");
  const auto depth = load_image(file);
  if (!depth) return pass_on(depth);
  if (depth->type() != CV_32FC1) {
    return fail(ErrorCode::invalid_input, "{}: not 32-bit float of one channel", (path_ / file.path).string());
  }
  Projection grid = *(*record)->grid;
  grid.width = depth->cols;
  grid.height = depth->rows;
  return range_image_of_grid(grid, (*record)->camera_from_pose, *depth);
}

Result<Calibration> ScanFolder::load_calibration() const {
  if (!manifest_.calibration)
    return fail(ErrorCode::not_found, "{}: the scan has no calibration", (path_ / kManifest).string());
  const std::lock_guard lock(loaded_->mutex);
  if (loaded_->calibration) return *loaded_->calibration;
  const auto text = read_recorded(path_, *manifest_.calibration);
  if (!text) return pass_on(text);
  auto calibration = parse_calibration(*text, path_ / manifest_.calibration->path);
  if (calibration) loaded_->calibration = *calibration;
  return calibration;
}

}  // namespace scanrig
