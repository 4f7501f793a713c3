#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>

#include "drivers/gpio/lines.h"
#include "drivers/projector/projector.h"

namespace scanrig {

struct GpioProjectorOptions {
  gpio::LineSpec pattern_line;               ///< fires the pattern and both cameras
  std::optional<gpio::LineSpec> plain_line;  ///< fires plain light and both cameras
  std::chrono::microseconds pulse{15000};    ///< at least the cameras' exposure
};

/// A dot projector fired by a pulse on a GPIO line whose edge is also the cameras' trigger.
/// request_off() ends a running pulse, and fire() then fails with `io`. A plain exposure fails with `unsupported` when
/// there is no line for it.
class GpioProjector final : public Projector {
 public:
  /// Fails with `not_found`, `io`.
  static Result<std::unique_ptr<GpioProjector>> open(const GpioProjectorOptions& options, gpio::Lines& lines,
                                                     Clock& clock);

  Result<void> fire(Light light, Deadline deadline) override;
  Result<void> turn_off(Deadline deadline) override;
  void request_off() noexcept override;

 private:
  GpioProjector(std::chrono::microseconds pulse, std::unique_ptr<gpio::Output> pattern,
                std::unique_ptr<gpio::Output> plain, Clock& clock)
      : pulse_(pulse), pattern_(std::move(pattern)), plain_(std::move(plain)), clock_(clock) {}

  const std::chrono::microseconds pulse_;
  const std::unique_ptr<gpio::Output> pattern_;
  const std::unique_ptr<gpio::Output> plain_;  // null without a plain line
  Clock& clock_;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool dark_requested_ = false;  // guarded by mutex_
};

}  // namespace scanrig
