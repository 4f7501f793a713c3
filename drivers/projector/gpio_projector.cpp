#include "drivers/projector/gpio_projector.h"

namespace scanrig {

Result<std::unique_ptr<GpioProjector>> GpioProjector::open(const GpioProjectorOptions& options, gpio::Lines& lines,
                                                           Clock& clock) {
  auto pattern = lines.output(options.pattern_line);
  if (!pattern) return pass_on(pattern, "projector");
  std::unique_ptr<gpio::Output> plain;
  if (options.plain_line) {
    auto line = lines.output(*options.plain_line);
    if (!line) return pass_on(line, "projector");
    plain = std::move(*line);
  }
  return std::unique_ptr<GpioProjector>(new GpioProjector(options.pulse, std::move(*pattern), std::move(plain), clock));
}

Result<void> GpioProjector::fire(Light light, Deadline deadline) {
  gpio::Output* const line = light == Light::pattern ? pattern_.get() : plain_.get();
  if (!line) return fail(ErrorCode::unsupported, "projector: plain_line is missing: no output fires plain light");
  if (deadline.left(clock_) < pulse_) {
    return fail(ErrorCode::timeout, "projector: a pulse of {} us does not fit before the deadline", pulse_.count());
  }
  std::unique_lock lock(mutex_);
  dark_requested_ = false;
  if (auto on = line->set(true); !on) {
    std::ignore = line->set(false);  // it may be on although it was not confirmed
    return pass_on(on, "projector");
  }
  const bool cut = clock_.wait_until(lock, wake_, clock_.now() + pulse_, [&] { return dark_requested_; });
  if (auto off = line->set(false); !off) return pass_on(off, "projector: the light may be on");
  if (cut) return fail(ErrorCode::io, "projector: went dark on request before the pulse was over");
  return {};
}

Result<void> GpioProjector::turn_off(Deadline) {
  const auto pattern_off = pattern_->set(false);
  const auto plain_off = plain_ ? plain_->set(false) : Result<void>{};
  if (!pattern_off) return pass_on(pattern_off, "projector: the light may be on");
  if (!plain_off) return pass_on(plain_off, "projector: the light may be on");
  return {};
}

void GpioProjector::request_off() noexcept {
  {
    const std::scoped_lock lock(mutex_);
    dark_requested_ = true;
  }
  clock_.notify_all(wake_);
}

}  // namespace scanrig
