#include <fcntl.h>
#include <fmt/format.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "core/timestamp.h"
#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/jobs/job_files.h"
#include "pipeline/calibration/watch/watch.h"
#include "pipeline/range/pair_fit.h"
#include "pipeline/storage/calibration_file.h"
#include "pipeline/storage/images.h"

namespace scanrig::ctl::doctor {
namespace {

using WallClock = std::chrono::system_clock;

constexpr double kMinMatched = 0.04;  ///< share of the pixels; by chance, in the wrong order, 0.013 to 0.022 match
constexpr double kExchanged = 2.0;    ///< times as many match with left and right exchanged
constexpr std::chrono::minutes kClockSlack{5};
constexpr double kMib = 1024.0 * 1024.0;
constexpr std::size_t kBlockBytes = 4 << 20, kSpeedBlocks = 16;
constexpr double kMinMibPerS = 20.0;  ///< two views of a pair of 5 megapixels each second

/// Whether it is of the cameras that the configuration names.
bool check_cameras(const Calibration& calibration, const config::RigConfig& rig, Report& report) {
  const auto [left, right] = rig.stereo_camera.serials();
  if (is_of_cameras(calibration, left, right)) return true;
  if (is_of_cameras(calibration, right, left)) {
    report.find("cameras_swapped",
                fmt::format("The calibration's left camera is {}, which the configuration names as the right one.",
                            calibration.left.serial),
                "Exchange left and right in [stereo_camera].");
  } else {
    report.find("other_calibration",
                fmt::format("The calibration is of the cameras {} and {}, the rig has {} and {}.",
                            calibration.left.serial, calibration.right.serial, left, right),
                "Name the calibration of these cameras in [calibration], or calibrate.");
  }
  return false;
}

void check_age(const Calibration& calibration, const config::RigConfig& rig, Report& report) {
  // Texts of one form: the later one is the greater one.
  const auto checked = std::max(calibration.date, last_check(rig.storage.root, calibration.sha256));
  const auto date = parse_iso_time(checked);
  if (!date) return report.note("its date cannot be read");
  const auto age = WallClock::now() - *date;
  report.note(fmt::format("made {}, last checked {}: {:.1f} days ago", calibration.date, checked,
                          std::chrono::duration<double, std::ratio<86400>>(age).count()));
  if (-age > kClockSlack) {
    return report.find(
        "clock_behind",
        fmt::format("The machine's clock shows {}, the calibration is from {}.", iso_time(WallClock::now()), checked),
        "Set the clock: timedatectl set-ntp true, or timedatectl set-time. Check the clock's battery.");
  }
  const auto limit = rig.calibration.check_every;
  if (limit.count() == 0 || age <= limit) return;
  report.find("calibration_old",
              fmt::format("The calibration was last checked {:.0f} h ago, check_every_h is {}.",
                          std::chrono::duration<double, std::ratio<3600>>(age).count(), limit.count()),
              "Put the board on the table and run scanrig calibrate --check.");
}

Result<PairFit> fit_images(const Calibration& calibration, const StereoFrame& pattern) {
  const auto left = to_usable_image(pattern.left, to_string(pattern.format));
  if (!left) return pass_on(left);
  const auto right = to_usable_image(pattern.right, to_string(pattern.format));
  if (!right) return pass_on(right);
  return fit_pair(calibration, *left, *right);
}

/// By images of whatever is on the table; at least its top is seen.
void check_fit(const Calibration& calibration, const StereoFrame& pattern, Report& report) {
  const auto fit = fit_images(calibration, pattern);
  if (!fit) {
    return report.find("calibration_fits_badly",
                       fmt::format("The images do not go with the calibration: {}.", fit.error().message),
                       "Correct region in [stereo_camera], or calibrate.");
  }
  const double max_px = WatchOptions{}.refused_px;
  report.note(
      fmt::format("pattern images: {:.1f} % of the pixels match, exchanged {:.1f} %; rows agree to {:.3f} px "
                  "(limit {:.2f})",
                  100 * fit->matched, 100 * fit->exchanged, fit->rows_px, max_px));
  if (fit->exchanged > kMinMatched && fit->exchanged > kExchanged * fit->matched) {
    return report.find("cameras_swapped",
                       fmt::format("Exchanged, {:.0f} % of the images' pixels match; as they are, {:.0f} %.",
                                   100 * fit->exchanged, 100 * fit->matched),
                       "Left and right camera have changed places: exchange their mounts or cables, or left and right "
                       "in [stereo_camera], then calibrate.");
  }
  if (fit->matched < kMinMatched) {
    return report.find(
        "calibration_fits_badly",
        fmt::format("Only {:.1f} % of the pattern images' pixels match by the calibration.", 100 * fit->matched),
        "A camera or lens was moved: fix it, then calibrate.");
  }
  if (!(fit->rows_px > max_px)) return;
  report.find(
      "calibration_moved",
      fmt::format("Rows of the images miss each other by {:.2f} px, more than {:.2f} px.", fit->rows_px, max_px),
      "A camera has turned since the calibration: clamp both, then calibrate.");
}

/// The folder itself or, where it is still to be made, its next parent.
std::filesystem::path existing(std::filesystem::path folder) {
  std::error_code ignored;
  folder = std::filesystem::absolute(folder, ignored);
  while (!std::filesystem::exists(folder, ignored) && folder != folder.parent_path()) folder = folder.parent_path();
  return folder;
}

/// MiB/s to the disk, synced; nothing where that failed.
std::optional<double> write_speed(const std::filesystem::path& folder, Clock& clock) {
  const auto file = folder / fmt::format(".speed-{}", ::getpid());
  const int out = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (out < 0) return std::nullopt;
  ::unlink(file.c_str());  // gone at any end of the program
  std::vector<std::uint32_t> block(kBlockBytes / sizeof(std::uint32_t));
  std::mt19937 noise(1);  // not to be compressed
  for (auto& word : block) word = static_cast<std::uint32_t>(noise());
  const auto begin = clock.now();
  bool is_written = true;
  for (std::size_t i = 0; i < kSpeedBlocks && is_written; ++i) {
    is_written = ::write(out, block.data(), kBlockBytes) == static_cast<ssize_t>(kBlockBytes);
  }
  is_written = is_written && ::fsync(out) == 0;
  const std::chrono::duration<double> took = clock.now() - begin;
  ::close(out);
  if (!is_written) return std::nullopt;
  return static_cast<double>(kSpeedBlocks * kBlockBytes) / kMib / took.count();
}

void check_disk(const config::StorageConfig& storage, Clock& clock, Report& report) {
  const auto folder = existing(storage.root);
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error) || ::access(folder.c_str(), W_OK | X_OK) != 0) {
    return report.find("folder_not_writable",
                       fmt::format("This user may not write to the job folder {}: {}.", folder.string(),
                                   std::strerror(std::filesystem::is_directory(folder, error) ? errno : ENOTDIR)),
                       "Give the folder to the user who runs the service: chown scanrig; or name another root in "
                       "[storage].");
  }
  const auto space = std::filesystem::space(folder, error);
  const double free_gib = error ? 0.0 : static_cast<double>(space.available) / (1024.0 * kMib);
  if (free_gib < storage.reserve_gib) {
    return report.find(
        "disk_full",
        fmt::format("The job disk has {:.1f} GiB left, reserve_gib is {:g}.", free_gib, storage.reserve_gib),
        "Delete jobs, set keep_days or keep_gib, or lower reserve_gib in [storage].");
  }
  const auto speed = write_speed(folder, clock);
  if (!speed) {
    return report.find("folder_not_writable",
                       fmt::format("A file cannot be written to {}: {}.", folder.string(), std::strerror(errno)),
                       "Check the disk: journalctl -k, smartctl -a.");
  }
  report.note(fmt::format("{}: {:.1f} GiB left, {:.0f} MiB/s written and synced", folder.string(), free_gib, *speed));
  if (*speed >= kMinMibPerS) return;
  report.find("slow_disk",
              fmt::format("The job disk takes {:.1f} MiB/s, a scan needs {:.0f} MiB/s.", *speed, kMinMibPerS),
              "Use an SSD of its own for the jobs; an SD card or a network disk is too slow.");
}

/// A machine without network has no time server, and may be sound.
void note_clock(Report& report) {
  timex state{};
  const bool is_set = ::adjtimex(&state) != TIME_ERROR;
  report.note(fmt::format("clock: {}, {}", iso_time(WallClock::now()),
                          is_set ? "set by a time server" : "not set by a time server; see timedatectl"));
}

}  // namespace

void examine_calibration(const Rig& rig, const TrialImages& images, bool may_match, Report& report) {
  report.section("Calibration");
  const auto calibration = read_calibration(rig.config.calibration_file);
  if (!calibration) {
    report.note("without one, whether left and right are exchanged cannot be judged");
    return report.find("no_calibration", calibration.error().message + ".",
                       "Calibrate: scanrig calibrate --rig, see docs/guide/calibrate.md.");
  }
  const bool is_of_rig = images.has_cameras && check_cameras(*calibration, rig.config, report);
  check_age(*calibration, rig.config, report);
  if (!is_of_rig) return;
  if (!may_match) return report.note("not compared with images: there are none to match");
  check_fit(*calibration, images.pattern, report);
}

void examine_machine(const Rig& rig, Clock& clock, Report& report) {
  report.section("Machine");
  note_clock(report);
  check_disk(rig.config.storage, clock, report);
}

}  // namespace scanrig::ctl::doctor
