#pragma once

#include <functional>
#include <thread>
#include <variant>

#include "daemon/mailbox.h"
#include "daemon/rig/acquisition.h"
#include "daemon/rig/preview.h"
#include "daemon/rig/turntable_thread.h"

namespace scanrig {

/// The owner of projector and camera, and through TurntableThread of the turntable: does one thing after the other and
/// tells the station how it went.
class RigThread {
 public:
  /// `preview` outlives it, is given every pair and is served with looks.
  RigThread(const Devices& devices, Clock& clock, AcquisitionOptions options, Preview& preview,
            std::function<void(Event)> tell);
  /// Stops what moves and joins.
  ~RigThread();
  RigThread(const RigThread&) = delete;
  RigThread& operator=(const RigThread&) = delete;

  void home() { inbox_.post(action::Home{}); }
  void take_view(action::TakeView view) { inbox_.post(std::move(view)); }
  void jog(action::Jog jog) { inbox_.post(jog); }
  void pulse() { inbox_.post(action::Pulse{}); }
  void check_devices() { inbox_.post(action::CheckDevices{}); }
  /// Cuts short what runs, then waits for evidence that the table stands and the projector is dark.
  void stop();
  /// The e-stop's short cut: the motor is told to stop and the light goes out at once. From any thread; the station
  /// follows with stop().
  void interrupt() noexcept;

 private:
  struct Look {};
  using Command = std::variant<action::Home, action::TakeView, action::Jog, action::Pulse, action::CheckDevices,
                               action::StopRig, Look>;

  void run();
  Event perform(const Command& command);
  void look();
  Result<void> home_now();

  TurntableThread turntable_;
  Devices devices_;
  Acquisition acquisition_;
  Preview& preview_;
  std::function<void(Event)> tell_;
  Mailbox<Command> inbox_;
  std::thread thread_;
};

}  // namespace scanrig
