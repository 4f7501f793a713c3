#include "drivers/projector/modbus_io_projector.h"

namespace scanrig {
namespace {

constexpr int kAttempts = 2;
constexpr int kReplyTimeouts = 8;  ///< to switch off and confirm it: two requests, each twice, each after a quiet line

}  // namespace

ModbusIoProjector::ModbusIoProjector(ModbusIoProjectorOptions options, Clock& clock)
    : options_(std::move(options)), clock_(clock), bus_(modbus::Bus::at(options_.line, clock)) {}

Result<void> ModbusIoProjector::fire(Light light, Deadline deadline) {
  const auto coil = light == Light::pattern ? std::optional(options_.pattern_coil) : options_.plain_coil;
  if (!coil) return fail(ErrorCode::unsupported, "projector: plain_channel is missing: no output fires plain light");
  if (deadline.left(clock_) < options_.pulse) {
    return fail(ErrorCode::timeout, "projector: a pulse of {} us does not fit before the deadline",
                options_.pulse.count());
  }
  {
    const std::scoped_lock lock(mutex_);
    dark_requested_ = false;
  }
  // Off has a deadline of its own: a late pulse must not keep the light on.
  const auto off = [&] {
    return switch_off(*coil, Deadline::after(clock_, kReplyTimeouts * options_.line.reply_timeout));
  };
  if (auto on = write(*coil, true, deadline); !on) {
    std::ignore = off();  // it may be on although it was not confirmed
    return pass_on(on, "projector");
  }
  std::unique_lock lock(mutex_);
  const bool cut = clock_.wait_until(lock, wake_, clock_.now() + options_.pulse, [&] { return dark_requested_; });
  lock.unlock();
  if (auto is_off = off(); !is_off) return is_off;
  if (cut) return fail(ErrorCode::io, "projector: went dark on request before the pulse was over");
  return {};
}

Result<void> ModbusIoProjector::turn_off(Deadline deadline) {
  const auto pattern_off = switch_off(options_.pattern_coil, deadline);
  const auto plain_off = options_.plain_coil ? switch_off(*options_.plain_coil, deadline) : Result<void>{};
  return pattern_off ? plain_off : pattern_off;
}

void ModbusIoProjector::request_off() noexcept {
  {
    const std::scoped_lock lock(mutex_);
    dark_requested_ = true;
  }
  clock_.notify_all(wake_);
}

Result<void> ModbusIoProjector::write(std::uint16_t coil, bool lit, Deadline deadline) {
  const auto bus = bus_->turn();
  auto written = bus->write_coil(coil, lit != options_.active_low, deadline);
  for (int attempt = 1; attempt < kAttempts && !written && bus->reply_missed(); ++attempt) {
    bus->count_retry();
    written = bus->write_coil(coil, lit != options_.active_low, deadline);
  }
  return written;
}

Result<void> ModbusIoProjector::switch_off(std::uint16_t coil, Deadline deadline) {
  constexpr auto kWho = "projector: the light may be on";
  if (auto written = write(coil, false, deadline); !written) return pass_on(written, kWho);
  const auto read = bus_->turn()->read_coils(coil, 1, deadline);
  if (!read) return pass_on(read, kWho);
  if (read->front() == options_.active_low) return {};
  return fail(ErrorCode::protocol, "{}: coil {} did not change; check the I/O module", kWho, coil);
}

}  // namespace scanrig
