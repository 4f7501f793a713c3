#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/api/server.h"
#include "daemon/jobs/bundle.h"
#include "daemon/jobs/job_store.h"
#include "daemon/jobs/job_thread.h"
#include "daemon/jobs/reconstructor.h"
#include "daemon/jobs/retention.h"
#include "daemon/journal/entry.h"
#include "daemon/rig/acquisition.h"
#include "daemon/rig/devices.h"
#include "daemon/station/control_loop.h"
#include "daemon/webhook/http_post.h"

namespace scanrig {

/// By the clock on the wall; `from` later than `to` means over midnight.
struct QuietHours {
  std::chrono::minutes from{}, to{};  ///< of the day

  /// Up to `to`, which is no longer one of them.
  [[nodiscard]] constexpr bool contain(std::chrono::minutes of_day) const {
    return from <= to ? of_day >= from && of_day < to : of_day >= from || of_day < to;
  }
};

struct DaemonOptions {
  JobStoreOptions jobs;
  std::filesystem::path state_folder{};                     ///< of the latch; empty: it does not outlive the process
  std::map<std::string, Recipe> recipes{{"default", {}}};   ///< "default" is what Start scans when nothing is queued
  std::optional<QuietHours> quiet_hours{};                  ///< no job begins by itself then
  std::chrono::seconds warm_up{0};                          ///< of the projector; nor before it is warm
  Clock::Duration disk_limit = std::chrono::seconds(30);    ///< a disk that does not answer for so long interrupts jobs
  Clock::Duration exit_timeout = std::chrono::seconds(30);  ///< for what is left when the control loop has ended; real
  /// The ending has taken longer: from a thread of its own, while the others still wait. Who cannot wait ends the
  /// process: what is acknowledged is on the disk.
  std::function<void(const Error&)> on_exit_hang = [](const auto&) {};
  Clock::Duration hang_margin = DeviceWatch::kMargin;     ///< a device's call that is so late hangs
  Clock::Duration hang_limit = std::chrono::seconds(10);  ///< one that is so late ends the daemon
  Clock::Duration panel_read_time{0};  ///< how long a reading of the panel may take beyond its deadline
  /// Stops the table by another path than the devices given: their turntable hangs. On a thread of its own; returns
  /// once the table is seen standing. Fails with why it may be moving; then the daemon ends.
  std::function<Result<void>()> stop_table_outside = [] {
    return Result<void>(fail(ErrorCode::unsupported, "turntable: no other path to its drive"));
  };
  RetentionOptions retention{};
  BundleOptions bundle{};                ///< without calibration and reserve, which are those of `jobs`
  std::optional<HttpAddress> webhook{};  ///< whom failures are told
  ApiOptions api;
  bool remote = false;        ///< the API may start and home while the guard is closed
  bool guard = false;         ///< there is a guard
  bool auto_home = false;     ///< after a restart a closed guard homes the table, without Reset
  bool manual_light = false;  ///< a hand switches the projector
  AcquisitionOptions acquisition;
  Clock::Duration warning = std::chrono::seconds(2);
  ReconstructorFactory reconstructor;
  JobThread::ScannedHook on_scanned;
  /// Called once nobody else can refuse, another daemon for one, and before a device is used. What it fails with, the
  /// daemon does.
  std::function<Result<void>()> takes_devices = [] { return Result<void>(); };
  /// Called once, before anything can move, with what takes presses and orders; it lives until `loop_ends` is called.
  std::function<void(ControlLoop&)> on_loop = [](ControlLoop&) {};
  std::function<void()> loop_ends = [] {};
  /// The control loop goes round, at least once a second; for the watchdog. From its thread; must not wait.
  std::function<void(const std::string& sentence)> alive = [](const auto&) {};
  /// Lines of the log. From the control loop's thread and the API's; must not wait.
  std::function<void(JournalEntry)> journal = [](const auto&) {};
  /// Called with every snapshot from the control loop's thread; must not wait.
  std::function<void(const std::shared_ptr<const Snapshot>&)> published = [](const auto&) {};
};

/// The daemon from start-up to a clean stop: owns all threads but the caller's, which becomes the control loop.
/// Returns after `stop` with the motor stopped, the projector dark and an unfinished job marked interrupted, or when a
/// reload was asked for. Fails with `io`, `refused` (another daemon), `invalid_input` before it begins, `timeout` when
/// the rig was not seen stopped at the end, or a device's call hangs for good: then `on_exit_hang` is called at once,
/// and the daemon returns only when the device does. The devices outlive the call.
Result<Ended> run_daemon(const Devices& devices, const DaemonOptions& options, Clock& clock, std::stop_token stop);

}  // namespace scanrig
