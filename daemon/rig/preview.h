#pragma once

#include <array>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/camera/stereo_camera.h"

namespace scanrig {

enum class Side { left, right };

/// What the cameras see, for people: the pair of the latest exposure, or of a look taken because somebody asks and
/// nothing else is to be done. A scan is never disturbed.
/// Threads: every function may be called from any.
class Preview {
 public:
  /// `quiet`: no scan is running and nothing moves, so the cameras are free.
  Preview(Clock& clock, std::function<bool()> quiet) : clock_(clock), quiet_(std::move(quiet)) {}

  /// The latest picture of one side as a JPEG; asks for a newer pair. Fails with `not_found` (no pair yet: ask again),
  /// and as the look failed while the cameras are free.
  Result<std::string> jpeg(Side side);

  // The rig's side.

  /// `look` is called when a pair is wanted; it is answered by one keep() or failed(). Null: nobody can look any more.
  void on_wanted(std::function<void()> look);
  void keep(const StereoFrame& pair);
  void failed(const Error& error);

 private:
  void ask_for_more();

  struct Encoded {
    std::uint64_t pair = 0;
    std::string bytes;
  };

  Clock& clock_;
  const std::function<bool()> quiet_;
  std::mutex mutex_;
  // Guarded by mutex_.
  std::function<void()> look_;
  bool asked_ = false;
  Clock::TimePoint not_before_{};  ///< no look until then
  std::uint64_t pairs_ = 0;
  StereoFrame latest_;
  std::optional<Error> problem_;  ///< of the last look
  std::array<Encoded, 2> encoded_;
};

}  // namespace scanrig
