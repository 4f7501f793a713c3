#include "drivers/serial/line_options.h"

#include <linux/serial.h>
#include <linux/tty_flags.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace scanrig::serial {
namespace {

constexpr std::uint32_t kRs485Flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND | SER_RS485_RTS_AFTER_SEND;

}  // namespace

PortControl kernel_port_control() {
  return [](int descriptor, unsigned long request, void* argument) { return ::ioctl(descriptor, request, argument); };
}

Result<void> use_rs485(int descriptor, const Rs485& options, const PortControl& control) {
  serial_rs485 wanted{};
  wanted.flags = SER_RS485_ENABLED | (options.high_while_sending ? SER_RS485_RTS_ON_SEND : SER_RS485_RTS_AFTER_SEND);
  wanted.delay_rts_before_send = static_cast<std::uint32_t>(options.before.count());
  wanted.delay_rts_after_send = static_cast<std::uint32_t>(options.after.count());
  serial_rs485 set = wanted;
  if (control(descriptor, TIOCSRS485, &set) != 0) {
    const int reason = errno;
    if (reason != ENOTTY && reason != EINVAL && reason != EOPNOTSUPP)
      return fail(ErrorCode::io, "{}", std::strerror(reason));
    return fail(ErrorCode::unsupported,
                "its driver does not switch the direction of RS-485 ({}); leave rs485 out for an adapter that switches "
                "by itself, or use another port",
                std::strerror(reason));
  }
  serial_rs485 got{};
  if (control(descriptor, TIOCGRS485, &got) != 0) return fail(ErrorCode::io, "{}", std::strerror(errno));
  if ((got.flags & kRs485Flags) == wanted.flags && got.delay_rts_before_send == wanted.delay_rts_before_send &&
      got.delay_rts_after_send == wanted.delay_rts_after_send) {
    return {};
  }
  return fail(ErrorCode::unsupported,
              "its driver keeps other values for rs485: RTS {} while sending, {} ms before, {} ms after; set these, or "
              "use another port",
              (got.flags & SER_RS485_RTS_ON_SEND) != 0 ? "high" : "low", got.delay_rts_before_send,
              got.delay_rts_after_send);
}

std::optional<std::string> request_low_latency(int descriptor, const std::string& device, const PortControl& control,
                                               const std::string& root) {
  serial_struct settings{};
  if (control(descriptor, TIOCGSERIAL, &settings) == 0 && (settings.flags & ASYNC_LOW_LATENCY) == 0) {
    settings.flags |= ASYNC_LOW_LATENCY;
    std::ignore = control(descriptor, TIOCSSERIAL, &settings);  // the adapter's timer shows whether it has an effect
  }
  std::error_code ignored;
  const std::string port = std::filesystem::weakly_canonical(device, ignored).filename().string();
  std::ifstream timer(root + "/sys/bus/usb-serial/devices/" + port + "/latency_timer");
  constexpr int kShortMs = 2;
  int ms = 0;
  if (!(timer >> ms) || ms <= kShortMs) return std::nullopt;
  return fmt::format(
      "the adapter passes bytes on after {} ms only: install the package's rules for devices, then plug it in again",
      ms);
}

}  // namespace scanrig::serial
