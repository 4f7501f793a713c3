#pragma once

#include <condition_variable>
#include <mutex>
#include <string>

#include "drivers/camera/camera_strobe.h"
#include "drivers/projector/projector.h"

namespace scanrig {

struct CameraStrobeProjectorOptions {
  std::string pattern_output;                   ///< of the camera, by its SFNC name; lights the pattern
  std::string plain_output;                     ///< lights plain light, without the pattern
  std::chrono::microseconds exposure{12000};    ///< of the camera: for this long the light is on
  std::chrono::milliseconds trigger_delay{20};  ///< longest time from the trigger's reply to the exposure
};

/// A dot projector fired by outputs of a camera, which are active while that camera exposes. fire() triggers the camera
/// by software. The output lights the projector and triggers the other camera. The exposure bounds the light, whatever
/// becomes of this process. Outputs are off between two fires.
/// request_off() ends the light of a running exposure, or an exposure not begun; fire() then fails with `io`.
/// Threads: the camera's owner; only request_off() may be called from another.
class CameraStrobeProjector final : public Projector {
 public:
  /// `strobe` outlives the projector.
  CameraStrobeProjector(CameraStrobeProjectorOptions options, CameraStrobe& strobe, Clock& clock)
      : options_(std::move(options)), strobe_(strobe), clock_(clock) {}

  /// Also fails with `invalid_input`, for a camera that rejects the output.
  Result<void> fire(Light light, Deadline deadline) override;
  Result<void> turn_off(Deadline deadline) override;
  void request_off() noexcept override;

 private:
  Result<void> expose(const std::string& output, Deadline deadline);
  [[nodiscard]] Result<void> expect_time(Deadline deadline) const;

  const CameraStrobeProjectorOptions options_;
  CameraStrobe& strobe_;
  Clock& clock_;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool off_requested_ = false;  // guarded by mutex_
};

}  // namespace scanrig
