#pragma once

#include <atomic>
#include <chrono>
#include <functional>

#include "core/clock.h"
#include "daemon/rig/devices.h"
#include "daemon/rig/image_checker.h"
#include "daemon/station/events.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

/// One view as the rig delivered it, in memory only.
struct TakenView {
  ViewId id;
  ViewRecord record{};  ///< `files` still empty
  RawView images{};
};

struct AcquisitionOptions {
  Clock::Duration home_limit = std::chrono::seconds(60);
  Clock::Duration move_limit = std::chrono::seconds(60);  ///< the longest move is one unwinding of all poses
  Clock::Duration fire_limit = std::chrono::seconds(2);
  /// Arm, collect and preview, each. The drivers wait half a second for a frame; for each GigE camera that vanished
  /// the library takes 2.5 s more.
  Clock::Duration camera_limit = std::chrono::seconds(7);
  Clock::Duration stop_limit = std::chrono::seconds(3);
  Clock::Duration check_limit = std::chrono::milliseconds(500);  ///< for each device
  /// For cameras that have to be connected: the library takes 2.5 s to notice each GigE camera that vanished.
  Clock::Duration connect_limit = std::chrono::seconds(8);
  int retake_limit = 3;  ///< exposures to retake in a row before the view fails
};

/// The order in which the devices do one thing. Every wait has a deadline.
/// Threads: one owner, which owns turntable, projector and camera too.
class Acquisition {
 public:
  /// `seen` is called with every pair fit for use.
  Acquisition(
      const Devices& devices, Clock& clock, AcquisitionOptions options,
      std::function<void(const StereoFrame&)> seen = [](const auto&) {})
      : devices_(devices), clock_(clock), options_(options), seen_(std::move(seen)) {}

  // Errors are passed on as the devices return them: each names its device.

  /// Clears an alarm, turns the projector off, homes. Fails as Turntable::home.
  Result<void> home();

  /// Turns to `angle`, the shorter way, and takes the four images. Retakes an exposure with lost, torn or unfit frames
  /// (see ImageChecker), or during which camera or projector vanished, and notes the reason.
  /// Unwinds a table wound up by several jobs on the way. Fails as the device that failed; the table has then been
  /// commanded to stop.
  /// `plain_only`: without the pattern's two images; those of the plain light are not judged, as the board's glare is
  /// no fault of the rig.
  Result<TakenView> take_view(const ViewId& id, Degrees angle, bool plain_only = false);

  /// Turns to `angle` as take_view() does. Fails as Turntable::rotate_to.
  Result<Move> turn_to(Degrees angle);

  /// Turns as an engineer requests, no faster than requested, and measures the angle. Fails as Turntable::rotate_to,
  /// and with `unsupported` where the speed cannot be limited.
  Result<Degrees> jog(const action::Jog& jog);

  /// Flashes the pattern once. Fails as Projector::fire.
  Result<void> pulse();

  /// Takes a pair without an exposure of the projector. Fails as StereoCamera::look.
  Result<StereoFrame> capture_preview();

  /// Sends a harmless request to each device, and reports the drive's motion and alarms. A drive that cannot report
  /// whether the table moves counts as absent.
  event::DevicesChecked check();

  struct Stop {
    Result<void> table;  ///< standstill confirmed
    Result<void> light;  ///< commanded to be off
  };
  /// Tries both, whatever the other returns.
  Stop stop();

  /// The device that the last error came from, as DeviceHealth names it. Only for the owner's thread.
  [[nodiscard]] const std::string& failed_device() const { return failed_; }

  /// Ends retakes in what runs now. From any thread.
  void interrupt() noexcept { ++interrupts_; }
  [[nodiscard]] unsigned interrupts() const { return interrupts_; }

 private:
  /// Passes on what a device returned; notes whose error it is.
  template <class Answer>
  Answer from(const char* device, Answer answer) {
    if (!answer) failed_ = device;
    return answer;
  }
  /// `before`: what interrupts() was when the view started.
  Result<StereoFrame> expose(Light light, unsigned before, std::vector<Error>& retake_reasons);
  Result<StereoFrame> expose_once(Light light);

  Devices devices_;
  Clock& clock_;
  AcquisitionOptions options_;
  const std::function<void(const StereoFrame&)> seen_;
  std::atomic<unsigned> interrupts_ = 0;
  ImageChecker image_checker_;
  bool judges_images_ = true;
  std::string job_;  ///< whose images it has seen
  std::string failed_;
  double position_deg_ = 0.0;  ///< where the last move ended, turns counted from home
};

}  // namespace scanrig
