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
#include "daemon/jobs/calibrator.h"
#include "daemon/jobs/job_store.h"
#include "daemon/jobs/job_thread.h"
#include "daemon/jobs/reconstructor.h"
#include "daemon/jobs/retention.h"
#include "daemon/journal/journal.h"
#include "daemon/rig/acquisition.h"
#include "daemon/rig/devices.h"
#include "daemon/station/control_loop.h"
#include "daemon/webhook/webhook.h"

namespace scanrig {

/// Wall clock times; `from` later than `to` means over midnight.
struct QuietHours {
  std::chrono::minutes from{}, to{};  ///< times of day

  /// Up to `to`, exclusive.
  [[nodiscard]] constexpr bool contain(std::chrono::minutes of_day) const {
    return from <= to ? of_day >= from && of_day < to : of_day >= from || of_day < to;
  }
};

struct DaemonOptions {
  JobStoreOptions jobs;
  std::filesystem::path state_folder{};                     ///< of the latch; empty: it does not outlive the process
  std::map<std::string, Recipe> recipes{{"default", {}}};   ///< "default" is what Start scans when nothing is queued
  std::optional<QuietHours> quiet_hours{};                  ///< no job starts automatically then
  std::chrono::seconds warm_up{0};                          ///< of the projector; nor before it is warm
  Clock::Duration disk_limit = std::chrono::seconds(30);    ///< a disk without response for this long interrupts jobs
  Clock::Duration exit_timeout = std::chrono::seconds(30);  ///< for threads left when the control loop has ended; real
  /// Called when shutdown takes longer: from a separate thread, while the others still wait. A caller that cannot wait
  /// ends the process: acknowledged views are on the disk.
  std::function<void(const Error&)> on_exit_hang = [](const auto&) {};
  Clock::Duration hang_margin = DeviceWatch::kMargin;     ///< a device's call that is this late hangs
  Clock::Duration hang_limit = std::chrono::seconds(10);  ///< one that is this late ends the daemon
  Clock::Duration panel_read_time{0};                     ///< time a reading of the panel may take beyond its deadline
  /// Stops the table by another path than the given devices: their turntable hangs. On a separate thread; returns
  /// once standstill is confirmed. Fails with why the table may be moving; then the daemon ends.
  std::function<Result<void>()> stop_table_outside = [] {
    return Result<void>(fail(ErrorCode::unsupported, "turntable: no other path to its drive"));
  };
  RetentionOptions retention{};
  BundleOptions bundle{};                ///< without calibration and reserve, which are in `jobs`
  std::optional<HttpAddress> webhook{};  ///< receiver of failure reports
  ApiOptions api;
  bool remote = false;        ///< the API may start and home while the guard is closed
  bool guard = false;         ///< there is a guard
  bool auto_home = false;     ///< after a restart a closed guard homes the table, without Reset
  bool manual_light = false;  ///< the projector is switched by hand
  bool lent = false;          ///< setup has the devices; the given ones are LentDevices
  AcquisitionOptions acquisition;
  Clock::Duration warning = std::chrono::seconds(2);
  ReconstructorFactory reconstructor;
  CalibratorOptions calibrator{};     ///< without a solver no calibration can begin
  bool accepts_calibrations = false;  ///< one that grades is used without a person
  JobThread::ScannedHook on_scanned;
  /// Called once nothing else can refuse, such as another daemon, and before a device is used. If it fails, the
  /// daemon fails with its error.
  std::function<Result<void>()> takes_devices = [] { return Result<void>(); };
  /// Called once, before anything can move, with the object that takes presses and orders. It lives until `loop_ends`.
  std::function<void(ControlLoop&)> on_loop = [](ControlLoop&) {};
  std::function<void()> loop_ends = [] {};
  /// Called while the control loop runs, at least once a second; for the watchdog. From its thread; must not wait.
  std::function<void(const std::string& sentence)> alive = [](const auto&) {};
  /// Lines of the log. From the control loop's thread and the API's; must not wait.
  std::function<void(JournalEntry)> journal = [](const auto&) {};
  /// Called with every snapshot from the control loop's thread; must not wait.
  std::function<void(const std::shared_ptr<const Snapshot>&)> published = [](const auto&) {};
};

/// The daemon from start-up to a clean stop: owns all threads but the caller's, which becomes the control loop.
/// Returns after `stop` with the motor stopped, the projector off and an unfinished job marked interrupted, or for a
/// requested reload. Fails with `io`, `refused` (another daemon), `invalid_input` before it starts. Fails with
/// `timeout` without confirmed standstill at the end, or when a device's call hangs for good. Then it calls
/// `on_exit_hang` at once, and returns only when the device does. The devices outlive the call.
Result<Ended> run_daemon(const Devices& devices, const DaemonOptions& options, Clock& clock,
                         const std::stop_token& stop);

}  // namespace scanrig
