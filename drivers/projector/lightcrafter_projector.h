#pragma once

#include <condition_variable>
#include <mutex>

#include "drivers/projector/lightcrafter_link.h"
#include "drivers/projector/projector.h"

namespace scanrig {

struct LightCrafterOptions {
  int image = 0;    ///< the random-dot pattern: index of the image in the device's flash
  int pattern = 0;  ///< and bit plane of that image, 0 to 23
  int depth = 1;    ///< bits, 1 to 8
  std::array<std::uint8_t, 3> led_current{100, 100,
                                          100};  ///< red, green, blue; 0 to 255, steps of the LED driver's current
  std::chrono::microseconds exposure{15000};     ///< of the light: at least the cameras' exposure
  dlpc350::LutEntry::Trigger trigger_in = dlpc350::LutEntry::Trigger::internal;  ///< else waits for TRIG_IN_1
  bool trigger_out_inverted = false;
  std::chrono::nanoseconds trigger_out_delay{0};  ///< of TRIG_OUT_1 after the light, -20 to +2.7 us
  std::chrono::nanoseconds trigger_in_delay{0};
  std::chrono::milliseconds reply_timeout{2000};
};

/// A TI DLP LightCrafter 4500 that shows the pattern from its flash, or all white, once per fire(); TRIG_OUT_1 is the
/// cameras' trigger. Connected by the first use, and again after a loss. Firmware that is too old or missing is
/// `unsupported`. request_off() ends a running exposure, and
/// fire() then fails with `io`. Faults that the device reports are `device_alarm` with their text. Options that it
/// rejects are `invalid_input`.
class LightCrafterProjector final : public Projector {
 public:
  /// Fails with `out_of_range` (an option outside the device's range).
  static Result<std::unique_ptr<LightCrafterProjector>> create(const LightCrafterOptions& options,
                                                               dlpc350::OpenTransport open, Clock& clock);

  Result<void> fire(Light light, Deadline deadline) override;
  Result<void> turn_off(Deadline deadline) override;
  void request_off() noexcept override;
  /// "LightCrafter 4500, firmware 4.1.0", since the first connection.
  [[nodiscard]] std::string description() const override { return description_; }

 private:
  using Bytes = dlpc350::Bytes;

  LightCrafterProjector(const LightCrafterOptions& options, dlpc350::OpenTransport open, Clock& clock)
      : options_(options), clock_(clock), link_(std::move(open), options.reply_timeout, clock) {}

  Result<void> connect(Deadline deadline);
  Result<void> check_firmware(Deadline deadline);
  Result<void> set_up(Deadline deadline);
  Result<void> load(Light light, Deadline deadline);
  Result<void> send_table(std::uint8_t mailbox, const Bytes& data, Deadline deadline);
  Result<void> validate(Deadline deadline);
  Result<void> expect_healthy(Deadline deadline);
  Result<void> stop(Deadline deadline);
  Result<void> wait_until_over(Deadline deadline);
  Result<bool> running(Deadline deadline);
  bool pause(Clock::Duration time);
  Result<void> write_all(const std::vector<std::pair<dlpc350::Command, Bytes>>& steps, Deadline deadline);
  Result<void> write(dlpc350::Command command, const Bytes& data, Deadline deadline);
  Result<std::uint8_t> read_byte(dlpc350::Command command, Deadline deadline);

  const LightCrafterOptions options_;
  Clock& clock_;
  dlpc350::Link link_;
  std::string description_;
  bool set_up_ = false;          // since the last connection
  std::optional<Light> loaded_;  // content of the device's table

  std::mutex mutex_;
  std::condition_variable wake_;
  bool dark_requested_ = false;  // guarded by mutex_
};

}  // namespace scanrig
