#include "daemon/jobs/job_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <tuple>
#include <utility>

#include "core/files.h"
#include "core/timestamp.h"
#include "daemon/jobs/job_files.h"
#include "daemon/jobs/job_index.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

// Names of folders that are being made or deleted; no job's id starts with a dot.
constexpr const char* kNew = ".new-";
constexpr const char* kGone = ".gone-";
constexpr std::uintmax_t kModelBytes = 128u
                                       << 20;  ///< mesh in all formats, textures, report: the largest seen is 90 MiB

constexpr std::uintmax_t kUnknownPairPixels = 2 * 20'000'000;  ///< of cameras without a calibration: large ones

void take_views(JobInfo& job, const Manifest& manifest) {
  job.config_sha256 = manifest.config_sha256;
  for (std::size_t p = 0; p < manifest.poses.size(); ++p) {
    const auto& pose = manifest.poses[p];
    const int number = static_cast<int>(p);
    for (const auto& view : pose.views) {
      job.stored.push_back(
          {number, view.index, view.measured_deg, view.retake_reasons, view.commanded_deg, view.settling_ms});
    }
    for (const auto& movement_check : pose.movement_checks) {
      job.movement_checks.push_back({number, movement_check.shift_px, movement_check.changed, movement_check.unmoved,
                                     movement_check.retake_reasons});
    }
    if (pose.complete) job.complete = number + 1;
  }
}

FolderFacts facts_of(const JobInfo& job, const std::string& manifest_state) {
  std::error_code ignored;
  const auto attempts = read_attempt_record(job.folder);
  FolderFacts facts{.manifest_state = manifest_state,
                    .has_report = fs::exists(report_file(job.folder), ignored),
                    .failure = read_failure(job.folder),
                    .deaths = attempts.ended_by_death,
                    .is_running = attempts.running};
  if (facts.has_report) facts.limit_violation = limit_violation(report_file(job.folder), job.recipe.limits);
  return facts;
}

Result<JobInfo> read_folder(const fs::path& folder, const ScanFolder& scan) {
  auto order = read_job_file(folder);
  if (!order) return pass_on(order);
  JobInfo job{.id = folder.filename(),
              .folder = folder,
              .recipe = std::move(order->recipe),
              .part = std::move(order->part),
              .place = order->place,
              .exported = order->exported,
              .model = model_file(folder, order->recipe.kind),
              .report = report_file(folder)};
  if (job.recipe.is_calibration()) {
    job.calibration = read_calibration_report(report_file(folder));
  } else {
    job.remarks = read_remarks(report_file(folder));
    take_choices(job);
  }
  if (job.calibration) job.calibration->is_accepted = order->accepted;
  take_views(job, scan.manifest());
  // Of one that was given another pose, and not yet queued for that.
  if (scan.manifest().state == "scanned" && job.complete > 0) job.recipe.poses = job.complete;
  const auto facts = facts_of(job, scan.manifest().state);
  return with_state_of_folder(std::move(job), facts);
}

JobInfo recover_job(const fs::path& folder) {
  auto scan = ScanFolder::open(folder);
  auto job = scan ? read_folder(folder, *scan) : pass_on(scan);
  if (job && job->state == JobState::interrupted && scan->manifest().state != "interrupted") {
    // On a full disk it stays unchanged, and every reader sees the same.
    std::ignore = scan->set_state("interrupted");
  }
  if (job) return *job;
  return {.id = folder.filename(), .folder = folder, .state = JobState::failed, .error = job.error()};
}

void remove_remains(const fs::path& root, const std::string& name) {
  if (!name.starts_with(kNew) && !name.starts_with(kGone)) return;
  std::error_code ignored;
  fs::remove_all(root / name, ignored);
}

double gib(std::uintmax_t bytes) { return static_cast<double>(bytes) / (1u << 30); }

/// Both pairs as text where the calibration is not of the rig's cameras. A missing serial number is not compared.
std::optional<std::string> other_cameras(const Calibration& calibration, const CameraSerials& rig) {
  if (is_of_cameras(calibration, rig.left, rig.right)) return {};
  const auto &left = calibration.left.serial, &right = calibration.right.serial;
  const auto named = [](const std::string& serial) { return serial.empty() ? std::string("unnamed") : serial; };
  return fmt::format("the cameras {} (left) and {} (right), but the rig has {} and {}", named(left), named(right),
                     named(rig.left), named(rig.right));
}

/// Keeps the calibration in `file` under its date. The same one is kept once, however often this is interrupted.
Result<void> keep_old_calibration(const fs::path& file, const std::string& replacement) {
  const auto old = read_file(file);
  if (!old && old.error().code == ErrorCode::not_found) return {};
  if (!old) return pass_on(old);
  if (*old == replacement) return {};
  const auto calibration = parse_calibration(*old, file);
  std::string date = calibration ? calibration->date : std::string();
  std::erase_if(date, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
  if (date.empty()) date = "undated";
  for (int copy = 1;; ++copy) {
    const auto kept =
        file.parent_path() / fmt::format("{}-{}{}{}", file.stem().string(), date,
                                         copy == 1 ? "" : fmt::format("-{}", copy), file.extension().string());
    const auto there = read_file(kept);
    if (there && *there == *old) return {};
    if (!there) return write_file_atomically(kept, *old);
  }
}

}  // namespace

Result<JobStore> JobStore::open(JobStoreOptions options) {
  std::error_code error;
  options.root = fs::absolute(options.root, error);
  if (auto made = create_directories_synced(options.root); !made) return pass_on(made);
  const int lock = ::open(options.root.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock < 0) return fail(ErrorCode::io, "cannot open {}: {}", options.root.string(), std::strerror(errno));
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock);
    return fail(ErrorCode::refused, "{}: another daemon keeps its jobs there: stop it or name another folder",
                options.root.string());
  }
  return JobStore(std::move(options), lock);
}

JobStore::~JobStore() {
  if (lock_ >= 0) ::close(lock_);
}

JobStore::JobStore(JobStore&& other) noexcept
    : options_(std::move(other.options_)), lock_(std::exchange(other.lock_, -1)) {}

Result<JobTable> JobStore::recover() const {
  JobIndex index(options_.root / "index.sqlite");
  JobTable jobs;
  std::error_code error;
  for (fs::directory_iterator next(options_.root, error), end; !error && next != end; next.increment(error)) {
    std::error_code ignored;
    if (!next->is_directory(ignored)) continue;
    const std::string id = next->path().filename();
    if (id.starts_with('.')) {
      remove_remains(options_.root, id);
      continue;
    }
    auto known = index.find(next->path());
    const auto job = std::make_shared<const JobInfo>(known ? std::move(*known) : recover_job(next->path()));
    jobs.emplace(id, job);
  }
  if (error) return fail(ErrorCode::io, "cannot list {}: {}", options_.root.string(), error.message());
  index.replace(jobs);
  return jobs;
}

Result<JobInfo> JobStore::read(const std::string& id) const {
  const auto scan = ScanFolder::open(folder(id));
  if (!scan) return pass_on(scan);
  return read_folder(folder(id), *scan);
}

Result<JobInfo> JobStore::create(const std::string& id, const JobFile& job) const {
  std::error_code ignored;
  if (fs::exists(folder(id), ignored)) {
    return fail(ErrorCode::exists, "{}: already there; name another folder or remove this one", folder(id).string());
  }
  Manifest manifest;
  manifest.id = id;
  manifest.created = iso_time(std::chrono::system_clock::now());
  manifest.state = "queued";
  manifest.profile = options_.profile;
  if (job.recipe.is_calibration()) manifest.source = "calibration";
  if (auto made = make(std::move(manifest), job); !made) {
    fs::remove_all(folder(id), ignored);  // renamed, but its name not synced: no client has its id
    return pass_on(made);
  }
  return read(id);
}

Result<void> JobStore::make(Manifest manifest, const JobFile& job) const {
  const auto id = manifest.id;
  const fs::path prepared = options_.root / (kNew + id);
  // A rig that is calibrated for the first time has none.
  const bool needs_none = job.recipe.is_calibration() && !read_calibration(options_.calibration_file);
  auto scan = ScanFolder::create(prepared, std::move(manifest), needs_none ? fs::path() : options_.calibration_file);
  auto made = scan ? write_job_file(prepared, job) : Result<void>(pass_on(scan));
  std::error_code ignored;
  fs::copy_file(job_log_file(folder(id)), job_log_file(prepared), ignored);  // from the folder that is replaced
  if (made) made = replace_folder(prepared, folder(id));
  if (!made) fs::remove_all(prepared, ignored);
  return made;
}

Result<void> JobStore::check_rig_cameras() const {
  const auto calibration = read_calibration(options_.calibration_file);
  if (!calibration && calibration.error().code == ErrorCode::not_found) {
    return fail(ErrorCode::refused, "there is none; run scanrig calibrate --rig");
  }
  if (!calibration) return pass_on(calibration);
  const auto others = other_cameras(*calibration, options_.cameras);
  if (!others) return {};
  return fail(ErrorCode::refused, "{} is for {}; calibrate, or install its file", options_.calibration_file.string(),
              *others);
}

std::string JobStore::calibration_reminder() const {
  if (options_.check_calibration_every.count() == 0) return {};
  const auto calibration = read_calibration(options_.calibration_file);
  if (!calibration) return {};
  // Texts of one form: the later one is the greater one.
  const auto date = std::max(calibration->date, last_check(options_.root, calibration->sha256));
  const auto taken = parse_iso_time(date);
  if (!taken || std::chrono::system_clock::now() - *taken < options_.check_calibration_every) return {};
  return fmt::format("The calibration was not checked for {} h: run scanrig calibrate --check.",
                     options_.check_calibration_every.count());
}

Result<void> JobStore::accept_calibration(const JobInfo& job) const {
  if (job.state != JobState::done || !job.calibration) {
    return fail(ErrorCode::refused, "job {} has no calibration to accept", job.id);
  }
  if (job.recipe.is_check() && job.calibration->verdict != "moved") {
    return fail(ErrorCode::refused, "the check {} offers no new poses", job.id);
  }
  const auto text = read_file(job.model);
  if (!text) return pass_on(text);
  const auto calibration = parse_calibration(*text, job.model);
  if (!calibration) return pass_on(calibration);
  if (const auto others = other_cameras(*calibration, options_.cameras)) {
    return fail(ErrorCode::refused, "the calibration of job {} is for {}", job.id, *others);
  }
  if (auto kept = keep_old_calibration(options_.calibration_file, *text); !kept) return kept;
  if (auto replaced = write_file_atomically(options_.calibration_file, *text); !replaced) return replaced;
  return set_accepted(job.folder, true);
}

Result<void> JobStore::check_job_cameras(const std::string& id) const {
  const auto scan = ScanFolder::open(folder(id));
  if (!scan) return pass_on(scan);
  const auto calibration = scan->load_calibration();
  if (!calibration) return pass_on(calibration);
  const auto others = other_cameras(*calibration, options_.cameras);
  if (!others) return {};
  return fail(ErrorCode::refused, "job {} was started with {}; cancel it and scan the part again", id, *others);
}

Result<void> JobStore::renew_calibration(const JobInfo& job) const {
  const auto scan = ScanFolder::open(job.folder);
  if (!scan) return pass_on(scan);
  const auto now = read_calibration(options_.calibration_file);
  if (!now) return pass_on(now);
  const auto& had = scan->manifest().calibration;
  if (had && had->sha256 == now->sha256) return {};
  const auto order = read_job_file(job.folder);
  if (!order) return pass_on(order);
  return make(scan->manifest(), *order);
}

Result<void> JobStore::check_room(const JobInfo& job) const {
  const bool calibrates = job.recipe.is_calibration();
  const auto calibration = read_calibration(options_.calibration_file);
  if (!calibration && !calibrates) return pass_on(calibration);
  const auto pixels = [](const Camera& camera) {
    return static_cast<std::uintmax_t>(camera.projection.width) * static_cast<std::uintmax_t>(camera.projection.height);
  };
  const auto views = static_cast<std::uintmax_t>(job.recipe.all_views()) - job.stored.size();
  const auto pair_pixels = calibration ? pixels(calibration->left) + pixels(calibration->right) : kUnknownPairPixels;
  const auto view_bytes = (calibrates ? 1 : 2) * pair_pixels * static_cast<std::uintmax_t>(options_.bytes_per_pixel);
  const auto needed = views * view_bytes + kModelBytes;
  std::error_code error;
  const auto space = fs::space(options_.root, error);
  if (error) return fail(ErrorCode::io, "cannot see the free space of {}: {}", options_.root.string(), error.message());
  if (space.available >= needed + options_.reserve_bytes) return {};
  return fail(
      ErrorCode::io,
      "the disk of {} has {:.1f} GiB left: the job needs {:.2f} and {:.1f} are kept free; remove or export jobs",
      options_.root.string(), gib(space.available), gib(needed), gib(options_.reserve_bytes));
}

Result<void> JobStore::remove(const std::string& id) const {
  std::error_code error;
  if (id.empty() || id.starts_with('.') || id.find('/') != std::string::npos || !fs::exists(folder(id), error)) {
    return fail(ErrorCode::not_found, "there is no job {}", id);
  }
  const fs::path gone = options_.root / (kGone + id);
  if (auto moved = replace_folder(folder(id), gone); !moved) return moved;
  fs::remove_all(gone, error);  // remaining files are deleted at the next start
  return {};
}

}  // namespace scanrig
