#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

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
  /// Exposures of the pattern offered to every view besides the configured one, as multiples of it.
  std::vector<double> pattern_factors{};
  int retake_limit = 3;  ///< exposures to retake in a row before the view fails
};

/// What is taken of a view.
enum class ViewExposures {
  all,          ///< pattern, plain light, and other exposures of the pattern if the view wants them
  one_pattern,  ///< one of each light: to compare with the same view taken before
  plain_only,   ///< of a calibration; not judged, as the board's glare is no fault of the rig
};

/// The order in which the devices do one thing. Every wait has a deadline.
/// Threads: one owner, which owns turntable, projector and camera too.
class Acquisition {
 public:
  /// `seen` is called with every pair fit for use that was exposed as configured.
  Acquisition(
      const Devices& devices, Clock& clock, AcquisitionOptions options,
      std::function<void(const StereoFrame&)> seen = [](const auto&) {})
      : devices_(devices), clock_(clock), options_(std::move(options)), seen_(std::move(seen)) {}

  // Errors are passed on as the devices return them: each names its device.

  /// Clears an alarm, turns the projector off, homes. Fails as Turntable::home.
  Result<void> home();

  /// Turns to `angle`, the shorter way, and takes the images. Retakes an exposure with lost, torn or unfit frames
  /// (see ImageChecker), or during which camera or projector vanished, and notes the reason.
  /// Unwinds a table wound up by several jobs on the way. Fails as the device that failed; the table has then been
  /// commanded to stop.
  Result<TakenView> take_view(const ViewId& id, Degrees angle, ViewExposures exposures = ViewExposures::all);

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
  /// Adds the other exposures that the view wants; afterwards the cameras expose as configured again.
  Result<void> add_exposures(TakenView& view, unsigned before);
  Result<void> set_exposure(double factor);

  Devices devices_;
  Clock& clock_;
  AcquisitionOptions options_;
  const std::function<void(const StereoFrame&)> seen_;
  std::atomic<unsigned> interrupts_ = 0;
  ImageChecker image_checker_;
  bool judges_images_ = true;
  std::optional<double> exposure_ = 1.0;  ///< the cameras' time, as a multiple; nothing: not known
  std::string job_;                       ///< whose images it has seen
  std::string failed_;
  double position_deg_ = 0.0;  ///< where the last move ended, turns counted from home
};

}  // namespace scanrig
