#pragma once

#include <atomic>
#include <chrono>
#include <functional>

#include "core/clock.h"
#include "daemon/rig/devices.h"
#include "daemon/rig/image_checker.h"
#include "daemon/rig/taken_view.h"

namespace scanrig {

struct AcquisitionOptions {
  Clock::Duration home_limit = std::chrono::seconds(60);
  Clock::Duration move_limit = std::chrono::seconds(60);     ///< the longest move is one unwinding of all poses
  Clock::Duration exposure_limit = std::chrono::seconds(2);  ///< arm, fire and collect, each
  Clock::Duration stop_limit = std::chrono::seconds(3);
  Clock::Duration check_limit = std::chrono::milliseconds(500);  ///< for each device
  /// For cameras that have to be connected: of a GigE camera that vanished the library takes 2.5 s to notice it, each.
  Clock::Duration connect_limit = std::chrono::seconds(8);
  int retake_limit = 3;                                          ///< spoilt exposures in a row before the view fails
};

/// The order in which the devices do one thing. Every wait has a deadline.
/// Threads: one owner, which owns turntable, projector and camera too.
class Acquisition {
 public:
  /// `seen` is told of every pair fit for use.
  Acquisition(
      const Devices& devices, Clock& clock, AcquisitionOptions options,
      std::function<void(const StereoFrame&)> seen = [](const auto&) {})
      : devices_(devices), clock_(clock), options_(options), seen_(std::move(seen)) {}

  // Errors are passed on as the devices say them: each names itself.

  /// Clears an alarm, darkens the projector, finds home. Fails as Turntable::home.
  Result<void> home();

  /// Turns to `angle`, the shorter way, and takes the four images. An exposure whose frames are lost, torn or not fit
  /// for use (see ImageChecker), or during which camera or projector vanished, is redone, and what was wrong with it
  /// noted. A table wound up by several jobs is unwound on the way. Fails as the device that failed; the table has been
  /// told to stop then.
  Result<TakenView> take_view(const ViewId& id, Degrees angle);

  /// Turns an engineer's way, no faster than asked; the angle measured. Fails as Turntable::rotate_to, and with
  /// `unsupported` where the speed cannot be limited.
  Result<Degrees> jog(const action::Jog& jog);

  /// One flash of the dots. Fails as Projector::fire.
  Result<void> pulse();

  /// A pair without an exposure of the projector. Fails as StereoCamera::look.
  Result<StereoFrame> capture_preview();

  /// Requests something harmless of each device, and reports what the drive says of motion and alarms. A drive that
  /// does not know whether the table moves is absent.
  event::DevicesChecked check();

  struct Stop {
    Result<void> table;  ///< seen standing
    Result<void> light;  ///< told to be dark
  };
  /// Both are tried, whatever the other says.
  Stop stop();

  /// The device that the last error came from, as DeviceHealth names it; of the owner's thread.
  [[nodiscard]] const std::string& failed_device() const { return failed_; }

  /// Nothing is redone in what runs now. From any thread.
  void interrupt() noexcept { ++interrupts_; }
  [[nodiscard]] unsigned interrupts() const { return interrupts_; }

 private:
  /// Passes on what a device answered; of an error, notes whose it is.
  template <class Answer>
  Answer from(const char* device, Answer answer) {
    if (!answer) failed_ = device;
    return answer;
  }
  Result<Move> turn_to(Degrees angle);
  /// `before`: what interrupts() was when the view was begun.
  Result<StereoFrame> expose(Light light, unsigned before, std::vector<Error>& retake_reasons);
  Result<StereoFrame> expose_once(Light light);

  Devices devices_;
  Clock& clock_;
  AcquisitionOptions options_;
  const std::function<void(const StereoFrame&)> seen_;
  std::atomic<unsigned> interrupts_ = 0;
  ImageChecker image_checker_;
  std::string job_;  ///< whose pictures it knows
  std::string failed_;
  double position_deg_ = 0.0;  ///< where the last move ended, turns counted from home
};

}  // namespace scanrig
