#include "daemon/jobs/slurm_submission.h"

#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>

#include "core/files.h"
#include "core/strict_json.h"
#include "daemon/jobs/node_run.h"
#include "pipeline/storage/pose_choices.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSubmission = "slurm.json";
constexpr const char* kRuns = "slurm";
constexpr const char* kStagedScan = "scan";

/// What a reconstruction reads of a scan's folder: its manifest, its calibration, its poses, and what a person picked.
bool is_needed(const fs::path& entry) {
  const auto name = entry.filename().string();
  return name == "scan.json" || name == "calibration.json" || name.starts_with("pose") || name == choices_folder();
}

Result<void> copy_scan(const fs::path& scan, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to, error);
  for (fs::directory_iterator next(scan, error), end; !error && next != end; next.increment(error)) {
    if (!is_needed(next->path())) continue;
    fs::copy(next->path(), to / next->path().filename(), fs::copy_options::recursive, error);
    if (error) break;
  }
  if (error) return fail(ErrorCode::io, "cannot copy {} to {}: {}", scan.string(), to.string(), error.message());
  return {};
}

/// Copies the files of a folder and syncs them.
Result<void> copy_synced(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::remove_all(to, error);
  if (auto made = create_directories_synced(to); !made) return made;
  for (fs::directory_iterator next(from, error), end; !error && next != end; next.increment(error)) {
    const auto bytes = read_file(next->path());
    if (!bytes) return pass_on(bytes);
    const FileContent file{next->path().filename().string(), std::as_bytes(std::span(*bytes))};
    if (auto written = write_files_synced(to, std::span(&file, 1)); !written) return written;
  }
  if (error) return fail(ErrorCode::io, "cannot copy {} to {}: {}", from.string(), to.string(), error.message());
  return {};
}

}  // namespace

std::string SlurmSubmission::name(const fs::path& scan) const {
  return fmt::format("scanrig-{}-{}", scan.filename().string(), run);
}

Result<void> write_submission(const fs::path& scan, const SlurmSubmission& submission) {
  const nlohmann::ordered_json json = {{"format", "scanrig-slurm"},
                                       {"version", 1},
                                       {"run", submission.run},
                                       {"job", submission.id},
                                       {"lost", submission.lost},
                                       {"voxel_mm", submission.changes.voxel_mm.value_or(0.0)},
                                       {"fusion", submission.changes.fusion}};
  return write_file_atomically(scan / kSubmission, json.dump(2) + "\n");
}

std::optional<SlurmSubmission> read_submission(const fs::path& scan) {
  auto json = JsonFile::read(scan / kSubmission, "scanrig-slurm", 1);
  if (!json) return std::nullopt;
  auto& root = json->root();
  SlurmSubmission submission{
      .run = root.text("run"), .id = root.text("job"), .lost = root.integer("lost", 0, 1000), .changes = {}};
  if (const double voxel_mm = root.number("voxel_mm", 0, 1000); voxel_mm > 0) submission.changes.voxel_mm = voxel_mm;
  submission.changes.fusion = root.text("fusion");
  const bool is_name = !submission.run.empty() && submission.run.find('/') == std::string::npos;
  return json->finish() && is_name ? std::optional(submission) : std::nullopt;
}

fs::path SlurmPlaces::run(const SlurmSubmission& submission) const {
  return stage_.empty() ? scan_ / kRuns / submission.run : stage_ / submission.name(scan_);
}

fs::path SlurmPlaces::scan_for_node(const SlurmSubmission& submission) const {
  return stage_.empty() ? scan_ : run(submission) / kStagedScan;
}

Result<void> SlurmPlaces::prepare(const SlurmSubmission& submission) const {
  std::error_code error;
  fs::create_directories(run(submission), error);
  if (error) return fail(ErrorCode::io, "cannot create {}: {}", run(submission).string(), error.message());
  return stage_.empty() ? Result<void>() : copy_scan(scan_, scan_for_node(submission));
}

Result<void> SlurmPlaces::take_model(const SlurmSubmission& submission, const fs::path& model) const {
  const auto made = run_model(run(submission));
  if (stage_.empty()) return replace_folder(made, model);
  auto prepared = model;
  prepared += ".new";
  auto taken = copy_synced(made, prepared);
  if (taken) taken = replace_folder(prepared, model);
  std::error_code ignored;
  if (!taken) fs::remove_all(prepared, ignored);
  return taken;
}

void SlurmPlaces::fetch_choices(const SlurmSubmission& submission) const {
  const auto found = scan_for_node(submission) / choices_folder();
  std::error_code ignored;
  if (stage_.empty() || !fs::exists(found, ignored)) return;
  const auto prepared = scan_ / ("." + choices_folder() + ".new");
  auto fetched = copy_synced(found, prepared);
  if (fetched) fetched = replace_folder(prepared, scan_ / choices_folder());
  if (!fetched) fs::remove_all(prepared, ignored);
}

void SlurmPlaces::remove_run(const SlurmSubmission& submission) const {
  std::error_code ignored;  // a remaining folder is deleted with its job
  fs::remove_all(run(submission), ignored);
  if (stage_.empty()) fs::remove(scan_ / kRuns, ignored);
}

void SlurmPlaces::forget(const SlurmSubmission& submission) const {
  std::ignore = remove_file_synced(scan_ / kSubmission);
  remove_run(submission);
}

}  // namespace scanrig
