#pragma once

#include "drivers/camera/sensor.h"

namespace scanrig {

/// Bounds of the start of an exposure, on the host's clock.
struct HostWindow {
  Clock::TimePoint begin;
  Clock::TimePoint end;
};

/// Tracks the triggers of one sensor. It holds the id of the last frame. It also holds, as an interval that every frame
/// narrows, the offset of the sensor's clock to the host's. So a skipped id or an exposure from before its trigger is
/// always detected, and the clocks of two sensors are never compared.
class TriggerTracker {
 public:
  enum class Finding {
    in_order,
    old_frame,       ///< its id or its stamp is not new, or it was exposed before the window
    frames_missing,  ///< newer than expected: triggers or frames in between are lost
    clock_jumped,    ///< exposed after its arrival: the sensor's clock was set
  };

  /// `id_ring`: number of ids until they restart; 0: they never do. `host_clock`: stamps are the host's.
  TriggerTracker(std::uint64_t id_ring, bool host_clock);

  [[nodiscard]] bool knows_id() const { return id_.has_value(); }
  [[nodiscard]] bool knows_clock() const { return clock_.has_value(); }

  /// Exposures further apart than this cannot be confused; nothing while the clock is unknown.
  [[nodiscard]] std::optional<Clock::Duration> uncertainty() const;

  [[nodiscard]] Finding check(const FrameStamp& frame, const HostWindow& window) const;
  /// Takes a frame that is in order, or at least not old, as the last one.
  void accept(const FrameStamp& frame, const HostWindow& window);
  /// Host time of an exposure on the sensor's clock, the best estimate within the window.
  [[nodiscard]] Clock::TimePoint host_time(const FrameStamp& frame, const HostWindow& window) const;

  void forget_id() { id_.reset(); }
  void forget();

 private:
  /// Host minus sensor, from `low` to `high`, at the last stamp `at` on the sensor's clock.
  struct Offset {
    std::chrono::nanoseconds low, high, at;
  };

  [[nodiscard]] std::int64_t steps_to(std::uint64_t id) const;
  [[nodiscard]] Offset offset_at(std::chrono::nanoseconds time) const;

  std::uint64_t id_ring_;
  bool host_clock_;
  std::optional<std::uint64_t> id_;
  std::optional<Offset> clock_;
};

/// Largest difference of two sensors' times since their last common trigger: jitter of the input and drift of two
/// crystals.
std::chrono::nanoseconds pair_tolerance(std::chrono::nanoseconds since);

}  // namespace scanrig
