#pragma once

#include <array>
#include <memory>
#include <vector>

#include "drivers/camera/sensor.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/camera/trigger_tracker.h"

namespace scanrig {

/// Method by which a pair's frames are matched with their trigger.
struct TriggeringOptions {
  enum class By {
    line,      ///< the edge on the sensors' input exposes; collect() is called after it
    software,  ///< collect() exposes, for light that stays on
    free_run,  ///< the sensors never stop; collect() takes the first pair that starts after the call
  };
  enum class FrameClock { interval, ptp };  ///< ptp: both sensors share one clock, so their stamps are compared
  By by = By::line;
  FrameClock frame_clock = FrameClock::interval;
  std::chrono::milliseconds frame_timeout{500};  ///< from collect() to the whole pair
  std::chrono::seconds idle_refresh{10};         ///< after this long without an exposure one is made and discarded
};

/// Counts of trigger results so far.
struct TriggerCounts {
  std::uint64_t pairs = 0;    ///< returned to the caller
  std::uint64_t lost = 0;     ///< a frame did not come in time
  std::uint64_t torn = 0;     ///< a frame came with parts missing
  std::uint64_t old = 0;      ///< a frame came, but was exposed before its trigger
  std::uint64_t odd = 0;      ///< ids skipped, more frames than triggers, sensors that do not agree, clocks set
  std::uint64_t strays = 0;   ///< discarded by arm()
  std::uint64_t warm_up = 0;  ///< exposures made and discarded
  std::uint64_t returns = 0;  ///< connected again after a loss
};

/// A stereo camera of two sensors, or of one that delivers both images side by side. Every exposure is checked: one
/// trigger, one whole frame from each sensor, ids without a gap, each sensor's interval since its last trigger in step
/// with the host's and with the other sensor's. After a failure, a reconnection or idle time prepare(), or else arm(),
/// waits for late frames. It then makes an exposure of its own (with sensors that have a software trigger), from which
/// the count restarts.
class SensorCamera final : public StereoCamera {
 public:
  /// `sensors`: left and right, or one for both.
  SensorCamera(std::vector<std::unique_ptr<Sensor>> sensors, const TriggeringOptions& options, Clock& clock);

  /// Also fails with `protocol`, for a sensor that exposes and delivers no valid frame.
  Result<void> prepare(Deadline deadline) override;
  /// Fails with `timeout`, `protocol`, `io`; also with `not_found`, `unsupported`, `invalid_input` for a sensor that
  /// must be reconnected and has changed.
  Result<void> arm(Deadline deadline) override;
  /// Fails with `timeout` (a frame is missing), `protocol` (torn, old, skipped, too many, different moments), `io`.
  Result<StereoFrame> collect(Deadline deadline) override;
  Result<void> scale_exposure(double factor, Deadline deadline) override;
  /// Takes a pair by software, one sensor after the other; of freely running sensors the next pair.
  Result<StereoFrame> capture_preview(Deadline deadline) override;

  /// Outputs of the left sensor that fire a projector, between arm() and collect(); null if there are none.
  [[nodiscard]] CameraStrobe* strobe() { return channels_.front().sensor->strobe(); }

  [[nodiscard]] const TriggerCounts& counts() const { return counts_; }

 private:
  struct Channel {
    std::unique_ptr<Sensor> sensor;
    TriggerTracker ledger;
    bool warm = false;  // warmed up since it was connected
  };
  struct Moments {
    std::chrono::nanoseconds left, right;  // each on its sensor's own clock
    [[nodiscard]] std::chrono::nanoseconds apart_since(const Moments& before) const;
    [[nodiscard]] bool agrees_with(const Moments& before) const;
  };

  Result<void> connect(Deadline deadline);
  Result<void> connect(Channel& channel, Deadline deadline);
  Result<void> get_in_step(Deadline deadline);
  Result<void> listen(Channel& channel);
  Result<void> select_source(Channel& channel, bool line);
  void forget(Channel& channel);
  Result<void> throw_away(Channel& channel, Clock::TimePoint until);
  Result<void> warm_up(Channel& channel, Deadline deadline);
  Result<std::optional<SensorFrame>> expose_once(Channel& channel, Deadline deadline);
  Result<SensorFrame> expose_by_software(Channel& channel, Deadline deadline);
  Result<SensorFrame> take(Channel& channel, Deadline deadline);
  Result<SensorFrame> take_running(Channel& channel, Deadline deadline);
  Result<void> expect_no_more(Channel& channel);
  Result<void> expect_one_moment(const std::vector<SensorFrame>& frames);
  Result<std::vector<SensorFrame>> take_all(Deadline deadline);
  StereoFrame hand_out(std::vector<SensorFrame>& frames);

  const TriggeringOptions options_;
  Clock& clock_;
  std::vector<Channel> channels_;
  std::optional<Moments> last_pair_, refused_pair_;  // since both sensors' clocks are known
  bool armed_ = false;
  bool in_step_ = false;  // no failure since the ledgers were last verified
  Clock::TimePoint trigger_after_{};
  Clock::TimePoint exposure_settled_{};  // frames that started earlier may have the exposure before
  Clock::TimePoint last_in_step_{};      // time of the last good exposure or warm-up
  TriggerCounts counts_;
};

}  // namespace scanrig
