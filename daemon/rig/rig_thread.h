#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <variant>

#include "daemon/mailbox.h"
#include "daemon/rig/acquisition.h"

namespace scanrig {

/// The owner of turntable, projector and camera: does one thing after the other and tells the station how it went.
class RigThread {
 public:
  RigThread(const Devices& devices, Clock& clock, AcquisitionOptions options, std::function<void(Event)> tell);
  /// Stops what moves and joins.
  ~RigThread();
  RigThread(const RigThread&) = delete;
  RigThread& operator=(const RigThread&) = delete;

  void home() { inbox_.post(action::Home{}); }
  void take_view(action::TakeView view) { inbox_.post(std::move(view)); }
  /// Cuts short what runs, then waits for evidence that the table stands and the projector is dark.
  void stop();

 private:
  using Command = std::variant<action::Home, action::TakeView, action::StopRig>;

  void run();
  Event perform(const Command& command);
  void interrupt() noexcept;
  Result<void> home_now();

  Devices devices_;
  Acquisition acquisition_;
  std::function<void(Event)> tell_;
  std::atomic<unsigned> interrupts_ = 0;
  Mailbox<Command> inbox_;
  std::thread thread_;
};

}  // namespace scanrig
