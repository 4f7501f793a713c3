#include "daemon/ctl/motion_session.h"

#include <fmt/format.h>
#include <pthread.h>

#include <condition_variable>
#include <csignal>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/signal_stop.h"
#include "daemon/ctl/motion_guardian.h"
#include "daemon/rig/open_devices.h"
#include "daemon/rig/panel_thread.h"

namespace scanrig::ctl {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// The daemon's 2 s, plus the longest time of the panel's thread until the lamp is lit.
constexpr milliseconds kWarning{2600};
constexpr seconds kPanelTimeout{2};
constexpr milliseconds kSupervisePeriod{50};
constexpr milliseconds kStandstillTimeout{1500};
constexpr milliseconds kDriveStopTimeout{500};

/// SignalStop leaves signals blocked; a prompt after the motion must end with Ctrl-C as before it.
class RestoredSignals {
 public:
  RestoredSignals() { ::pthread_sigmask(SIG_SETMASK, nullptr, &before_); }
  ~RestoredSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  RestoredSignals(const RestoredSignals&) = delete;
  RestoredSignals& operator=(const RestoredSignals&) = delete;

 private:
  sigset_t before_{};
};

/// Why nothing may move, from the panel's inputs.
std::optional<Error> obstacle(const PanelInputs& inputs) {
  if (!inputs.estop_ok) return Error{ErrorCode::refused, "e-stop: pressed. Release it, then try again"};
  if (!inputs.guard_closed) return Error{ErrorCode::refused, "guard: open. Close it, then try again"};
  if (inputs.stop) return Error{ErrorCode::refused, "Stop button: pressed. Release it, then try again"};
  return std::nullopt;
}

class MotionSession final : public Motion {
 public:
  MotionSession(const config::RigConfig& config, Clock& clock, MotionGuardian& guardian)
      : config_(config), clock_(clock), guardian_(guardian), signals_(SignalStop::Hangup::is_told) {
    signals_.on_hangup([this] { stop({ErrorCode::stopped, "stopped: the terminal is gone"}); });
    lines_ = open_lines(config_, clock_);
    panel_ = open_panel(config_, *lines_, clock_);
    panel_thread_.emplace(
        *panel_, clock_, PanelThreadOptions{.read_time = panel_read_time(config_.panel)},
        [this](const Event& event) { panel_event(event); }, [this] { estop(); });
    supervisor_ = std::thread([this] { supervise(); });
  }
  ~MotionSession() override { close(); }

  Result<void> check_panel();
  Result<void> turn(const std::function<Result<void>(Turntable&)>& move) override;
  Result<void> turn_drive(const DriveMove& move) override;
  /// `result`: of all the moves. Success only with standstill confirmed.
  Result<void> end(Result<void> result);

 private:
  void estop();
  void panel_event(const Event& event);
  void supervise();
  void stop(Error cause);
  Result<void> warn();
  Result<void> run(std::function<void()> request_stop, const std::function<Result<void>()>& move);
  Result<void> open_table();
  Result<void> confirm_standstill();
  void close();

  const config::RigConfig& config_;
  Clock& clock_;
  MotionGuardian& guardian_;
  const RestoredSignals restored_signals_;
  SignalStop signals_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<PanelInputs> inputs_;   // under the mutex, as all up to the threads
  std::optional<Error> cause_;          // the first reason to stop
  std::function<void()> request_stop_;  // for what moves now
  bool is_moving_ = false;
  bool is_ending_ = false;

  std::unique_ptr<gpio::Lines> lines_;
  std::unique_ptr<Panel> panel_;
  std::optional<PanelThread> panel_thread_;
  std::thread supervisor_;
  // Only for the owner's thread.
  std::unique_ptr<Turntable> table_;
  bool has_warned_ = false;
  bool has_moved_ = false;
  std::optional<Error> handed_over_;  // to the guardian: why the standstill was not seen from here
};

/// Reads the inputs first; one that was pressed all along is an obstacle.
void MotionSession::estop() {
  {
    const std::lock_guard lock(mutex_);
    if (!inputs_) return;
  }
  stop({ErrorCode::stopped, "e-stop: pressed during motion. Release it, then try again"});
}

void MotionSession::panel_event(const Event& event) {
  if (const auto* seen = std::get_if<event::InputsRead>(&event)) {
    const std::lock_guard lock(mutex_);
    inputs_ = seen->inputs;
    clock_.notify_all(changed_);
  } else if (const auto* guard = std::get_if<event::GuardChanged>(&event); guard && !guard->closed) {
    stop({ErrorCode::stopped, "guard: opened during motion. Close it, then try again"});
  } else if (const auto* button = std::get_if<event::Pressed>(&event); button && button->button == Button::stop) {
    stop({ErrorCode::stopped, "stopped by the panel's Stop button"});
  } else if (const auto* failed = std::get_if<event::PanelFailed>(&event)) {
    stop(failed->error);
  }
}

/// Runs beside everything else: signals, a panel whose read hangs, and the guardian's life.
void MotionSession::supervise() {
  const auto token = signals_.token();
  const std::stop_callback on_signal(token, [this] { stop({ErrorCode::stopped, "stopped by a signal"}); });
  std::unique_lock lock(mutex_);
  while (!clock_.wait_until(lock, changed_, clock_.now() + kSupervisePeriod, [this] { return is_ending_; })) {
    const bool has_guardian = guardian_.report(is_moving_);
    lock.unlock();
    if (!has_guardian) stop({ErrorCode::timeout, "motion guardian: ended unexpectedly. Try again"});
    if (const auto call = panel_thread_->hung()) stop(hung_error(*call));
    lock.lock();
  }
}

/// Stops the table. From any thread.
void MotionSession::stop(Error cause) {
  const std::lock_guard lock(mutex_);
  if (cause_) return;
  cause_ = std::move(cause);
  if (request_stop_) request_stop_();
  clock_.notify_all(changed_);
}

Result<void> MotionSession::check_panel() {
  std::unique_lock lock(mutex_);
  clock_.wait_until(lock, changed_, clock_.now() + kPanelTimeout, [this] { return inputs_ || cause_; });
  if (cause_) return tl::unexpected(*cause_);
  if (!inputs_) return fail(ErrorCode::timeout, "panel: no reply, e-stop unknown. Check the panel's power and cable");
  auto why = obstacle(*inputs_);
  return why ? Result<void>(tl::unexpect, std::move(*why)) : Result<void>();
}

/// Lights the lamp, before the first move.
Result<void> MotionSession::warn() {
  if (!std::exchange(has_warned_, true)) {
    panel_thread_->show({.amber = true, .busy = true});
    std::unique_lock lock(mutex_);
    clock_.wait_until(lock, changed_, clock_.now() + kWarning, [this] { return cause_.has_value(); });
  }
  return check_panel();
}

Result<void> MotionSession::run(std::function<void()> request_stop, const std::function<Result<void>()>& move) {
  {
    const std::lock_guard lock(mutex_);
    if (cause_) return tl::unexpected(*cause_);
    request_stop_ = std::move(request_stop);
    is_moving_ = has_moved_ = true;
    guardian_.report(true);
  }
  auto moved = move();
  const std::lock_guard lock(mutex_);
  request_stop_ = nullptr;
  is_moving_ = !moved;  // until the standstill is confirmed
  if (cause_) return tl::unexpected(*cause_);
  return moved;
}

Result<void> MotionSession::open_table() {
  if (table_) return {};
  auto table = open_turntable(config_.turntable, clock_);
  if (!table) return pass_on(table);
  table_ = std::move(*table);
  return {};
}

Result<void> MotionSession::turn(const std::function<Result<void>(Turntable&)>& move) {
  if (auto warned = warn(); !warned) return warned;
  if (auto opened = open_table(); !opened) return opened;
  return run([this] { table_->request_stop(); }, [&] { return move(*table_); });
}

Result<void> MotionSession::turn_drive(const DriveMove& move) {
  if (auto warned = warn(); !warned) return warned;
  table_.reset();  // the port has one owner
  ModbusDrive drive(config_.turntable.modbus.line, config_.turntable.modbus.profile, clock_);
  std::atomic<bool> is_stop_requested = false;
  const auto request_stop = [&] {
    is_stop_requested = true;
    drive.set_fail_fast(true);
  };
  return run(request_stop, [&]() -> Result<void> {
    auto moved = move(drive, is_stop_requested);
    if (moved) return moved;
    drive.stop_without_reply();
    drive.set_fail_fast(false);
    std::ignore = drive.stop(Deadline::after(clock_, kDriveStopTimeout));  // confirmed in end()
    return moved;
  });
}

Result<void> MotionSession::confirm_standstill() {
  if (!has_moved_) return {};
  if (auto opened = open_table(); !opened) return opened;
  auto stopped = table_->stop(Deadline::after(clock_, kStandstillTimeout));
  if (stopped) return stopped;
  fmt::print(stderr, "scanrig: {}. Keep clear: stop is sent again until the drive responds\n", stopped.error().message);
  close();  // the guardian needs the devices
  handed_over_ = stopped.error();
  return guardian_.take_over();
}

Result<void> MotionSession::end(Result<void> result) {
  auto stopped = confirm_standstill();
  if (result && handed_over_) result = tl::unexpected(*handed_over_);  // what it tried last cannot be believed
  if (const std::lock_guard lock(mutex_); result && cause_) result = tl::unexpected(*cause_);
  if (panel_thread_) panel_thread_->show({.red = has_moved_ && !result});
  close();
  if (stopped && !handed_over_) guardian_.dismiss();
  if (!stopped) {
    return result ? stopped : fail(stopped.error().code, "{}; {}", result.error().message, stopped.error().message);
  }
  return result;
}

/// Closes panel, table and threads; the lamps stay as shown last.
void MotionSession::close() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    clock_.notify_all(changed_);
  }
  signals_.on_hangup(nullptr);
  if (supervisor_.joinable()) supervisor_.join();
  panel_thread_.reset();
  panel_.reset();
  table_.reset();
}

}  // namespace

Result<void> with_motion(const config::RigConfig& config, const std::filesystem::path& file, Clock& clock,
                         const std::function<Result<void>(Motion&)>& moves) {
  auto guardian = MotionGuardian::start(file, clock);
  if (!guardian) return pass_on(guardian);
  MotionSession session(config, clock, *guardian);
  auto checked = session.check_panel();
  return session.end(checked ? moves(session) : checked);
}

}  // namespace scanrig::ctl
