#pragma once

#include <functional>
#include <optional>
#include <thread>
#include <variant>

#include "daemon/rig/acquisition.h"
#include "daemon/rig/preview.h"
#include "daemon/rig/turntable_thread.h"
#include "daemon/rig/watched_devices.h"
#include "daemon/runtime/mailbox.h"

namespace scanrig {

/// The owner of projector and camera, and through TurntableThread of the turntable: does one thing after the other and
/// tells the station how it went.
class RigThread {
 public:
  /// `preview` outlives it, is given every pair and is served with looks.
  /// `hang_margin`: a call that is so late hangs.
  RigThread(const Devices& devices, Clock& clock, AcquisitionOptions options, Preview& preview,
            std::function<void(Event)> post_event, Clock::Duration hang_margin = DeviceWatch::kMargin);
  /// Stops what moves and joins.
  ~RigThread();
  RigThread(const RigThread&) = delete;
  RigThread& operator=(const RigThread&) = delete;

  void home() { post(action::Home{}); }
  void take_view(action::TakeView view) { post(std::move(view)); }
  void jog(action::Jog jog) { post(jog); }
  void pulse() { post(action::Pulse{}); }
  void check_devices() { post(action::CheckDevices{}); }
  /// Cuts short what runs, and what is still to begin: a motion or a flash asked for before does not begin. Then waits
  /// for evidence that the table stands and the projector is dark.
  void stop();
  /// The e-stop's short cut: the motor is told to stop and the light goes out at once. From any thread; the station
  /// follows with stop().
  void interrupt() noexcept;
  /// While a call of projector or camera hangs: stop() through the turntable's own thread, past this one.
  void stop_directly();
  /// The call this thread or the turntable's hangs in, the turntable's first. From any thread.
  [[nodiscard]] std::optional<HungCall> hung() const;

 private:
  struct Look {};
  using Command = std::variant<action::Home, action::TakeView, action::Jog, action::Pulse, action::CheckDevices,
                               action::StopRig, Look>;

  struct Asked {
    Command what;
    unsigned interrupts;  ///< so many had been when it was asked for
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
