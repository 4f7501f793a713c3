#pragma once

#include <functional>
#include <optional>
#include <thread>
#include <variant>

#include "daemon/rig/acquisition.h"
#include "daemon/rig/devices.h"
#include "daemon/rig/preview.h"
#include "daemon/rig/turntable_thread.h"
#include "daemon/runtime/actor.h"

namespace scanrig {

/// The owner of projector and camera, and through TurntableThread of the turntable. Does one thing after the other and
/// reports the outcome to the station.
class RigThread {
 public:
  /// `preview` outlives it, is given every pair and gets its images from it.
  /// `hang_margin`: a call that is this late hangs.
  RigThread(const Devices& devices, Clock& clock, const AcquisitionOptions& options, Preview& preview,
            std::function<void(Event)> post_event, Clock::Duration hang_margin = DeviceWatch::kMargin);
  /// Stops what moves and joins.
  ~RigThread();
  RigThread(const RigThread&) = delete;
  RigThread& operator=(const RigThread&) = delete;

  void home() { post(action::Home{}); }
  void take_view(action::TakeView view) { post(std::move(view)); }
  void turn_to(action::TurnTo turn) { post(turn); }
  void jog(action::Jog jog) { post(jog); }
  void pulse() { post(action::Pulse{}); }
  void check_devices() { post(action::CheckDevices{}); }
  /// Cuts short what runs and what is still to start: a motion or flash requested before does not start. Then waits
  /// for evidence that the table has stopped and the projector is off.
  void stop();
  /// The e-stop's short cut: commands the motor to stop and turns the light off at once. From any thread; the station
  /// follows with stop().
  void interrupt() noexcept;
  /// For a projector or camera call that hangs: stop() through the turntable's own thread, past this one.
  void stop_directly();
  /// The call in which this thread or the turntable's hangs, the turntable's first. From any thread.
  [[nodiscard]] std::optional<HungCall> hung() const;

 private:
  struct Look {};
  using Command = std::variant<action::Home, action::TakeView, action::TurnTo, action::Jog, action::Pulse,
                               action::CheckDevices, action::StopRig, Look>;

  struct Asked {
    Command what;
    unsigned interrupts;  ///< count when the work was requested
  };

  template <class What>
  void post(What what) {
    inbox_.post(Asked{.what = std::move(what), .interrupts = acquisition_.interrupts()});
  }
  void run();
  Event perform(const Asked& asked);
  void capture_preview();
  Result<void> home_now(unsigned interrupts);

  // Before the turntable's thread, which uses them.
  const std::function<void(Event)> post_event_;
  const Clock::Duration stop_limit_;
  WatchedTurntable watched_turntable_;
  WatchedProjector projector_;
  WatchedCamera camera_;
  TurntableThread turntable_;
  Devices devices_;
  Acquisition acquisition_;
  Preview& preview_;
  Mailbox<Asked> inbox_;
  std::thread thread_;
};

}  // namespace scanrig
