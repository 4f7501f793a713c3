#include "drivers/modbus/client.h"

#include <modbus.h>
#include <poll.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace scanrig::modbus {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr char letter(Parity parity) {
  switch (parity) {
    case Parity::none: return 'N';
    case Parity::even: return 'E';
    case Parity::odd: return 'O';
  }
  return 'N';
}

/// Silence that separates two frames: 3.5 characters, 1.75 ms from 19200 baud up [Modbus over serial line
/// V1.02, 2.5.1.1].
microseconds frame_gap(int baud) { return baud > 19200 ? microseconds(1750) : microseconds(3'500'000 * 11 / baud); }

bool port_lost(int error) {
  return error == EIO || error == EBADF || error == ENXIO || error == ENODEV || error == EPIPE || error == ECONNRESET;
}

bool refused(int error) { return error >= EMBXILFUN && error <= EMBXGTAR; }

/// Leadshine's "wrong CRC": the request reached the device damaged and was not carried out.
constexpr int kDeviceSawWrongCrc = EMBXMEMPAR;

/// Longest time until a caller that waits for a quiet line notices set_fail_fast().
constexpr Clock::Duration kLook = milliseconds(5);

enum class Heard { nothing, something, hangup };

/// Discards bytes that arrive within `wait`, up to the first byte.
Heard discard(int port, Clock::Duration wait) {
  pollfd watched{port, POLLIN, 0};
  if (::poll(&watched, 1, static_cast<int>(std::chrono::ceil<milliseconds>(wait).count())) <= 0) return Heard::nothing;
  // Reading would not show it: a port that hung up reads like one without data.
  if (watched.revents & (POLLHUP | POLLERR | POLLNVAL)) return Heard::hangup;
  std::array<char, 256> bytes;
  return ::read(port, bytes.data(), bytes.size()) > 0 ? Heard::something : Heard::nothing;
}

}  // namespace

void Client::Closer::operator()(_modbus* context) const {
  modbus_close(context);
  modbus_free(context);
}

Client::Client(ClientOptions options, Clock& clock)
    : options_(std::move(options)), clock_(clock), last_byte_(clock.now()) {}

Client::~Client() = default;

std::string Client::who() const { return fmt::format("{} unit {}", options_.device, options_.unit_id); }

Result<std::vector<std::uint16_t>> Client::read(std::uint16_t address, int count, Deadline deadline) {
  std::vector<std::uint16_t> values(static_cast<std::size_t>(count));
  const auto done = request("read", address, deadline,
                            [&](_modbus* line) { return modbus_read_registers(line, address, count, values.data()); });
  if (!done) return pass_on(done);
  return values;
}

Result<std::vector<bool>> Client::read_coils(std::uint16_t address, int count, Deadline deadline) {
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(count));
  const auto done = request("read coils", address, deadline,
                            [&](_modbus* line) { return modbus_read_bits(line, address, count, bits.data()); });
  if (!done) return pass_on(done);
  return std::vector<bool>(bits.begin(), bits.end());
}

Result<std::vector<bool>> Client::read_inputs(std::uint16_t address, int count, Deadline deadline) {
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(count));
  const auto done = request("read inputs", address, deadline,
                            [&](_modbus* line) { return modbus_read_input_bits(line, address, count, bits.data()); });
  if (!done) return pass_on(done);
  return std::vector<bool>(bits.begin(), bits.end());
}

Result<void> Client::write_coil(std::uint16_t address, bool on, Deadline deadline) {
  return request("write coil", address, deadline,
                 [&](_modbus* line) { return modbus_write_bit(line, address, on ? 1 : 0); });
}

Result<void> Client::write_coils(std::uint16_t address, const std::vector<bool>& on, Deadline deadline) {
  const std::vector<std::uint8_t> bits(on.begin(), on.end());
  return request("write coils", address, deadline, [&](_modbus* line) {
    return modbus_write_bits(line, address, static_cast<int>(bits.size()), bits.data());
  });
}

Result<void> Client::write(std::uint16_t address, std::uint16_t value, Deadline deadline) {
  return request("write", address, deadline,
                 [&](_modbus* line) { return modbus_write_register(line, address, value); });
}

Result<void> Client::write(std::uint16_t address, std::span<const std::uint16_t> values, Deadline deadline) {
  return request("write", address, deadline, [&](_modbus* line) {
    return modbus_write_registers(line, address, static_cast<int>(values.size()), values.data());
  });
}

Result<void> Client::write_without_reply(std::uint16_t address, std::uint16_t value) {
  if (!context_) {
    if (auto opened = open(); !opened) return opened;
  }
  const auto low = [](int word) { return static_cast<std::uint8_t>(word & 0xFF); };
  const std::array<std::uint8_t, 6> frame{low(options_.unit_id), 0x06,      low(address >> 8), low(address),
                                          low(value >> 8),       low(value)};
  clock_.sleep_until(last_byte_ + frame_gap(options_.baud));
  ++statistics_.requests;
  const int sent = modbus_send_raw_request(context_.get(), frame.data(), static_cast<int>(frame.size()));
  const int error = errno;
  last_byte_ = clock_.now();
  reply_missed_ = true;
  if (sent > 0) return {};
  return failed(error, fmt::format("{}: write 0x{:04X}", who(), address));
}

Result<void> Client::request(std::string_view what, std::uint16_t address, Deadline deadline,
                             const std::function<int(_modbus*)>& exchange) {
  if (!context_) {
    if (auto opened = open(); !opened) return opened;
  }
  const Heard unasked = discard(modbus_get_socket(context_.get()), Clock::Duration::zero());
  if (unasked == Heard::hangup) return failed(EIO, who());
  if (unasked == Heard::something) {
    reply_missed_ = true;
    ++statistics_.corrupt;
  }
  if (reply_missed_) {
    if (auto quiet = wait_until_quiet(deadline); !quiet) return quiet;
  }
  clock_.sleep_until(last_byte_ + frame_gap(options_.baud));
  const auto left = std::chrono::duration_cast<microseconds>(deadline.left(clock_));
  const auto wait = std::min<microseconds>(left, options_.reply_timeout);
  if (wait.count() <= 0) {
    return fail(ErrorCode::timeout, "{}: the deadline passed before 0x{:04X} could be asked", who(), address);
  }
  modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(wait.count() / 1'000'000),
                              static_cast<std::uint32_t>(wait.count() % 1'000'000));
  ++statistics_.requests;
  const int answer = exchange(context_.get());
  const int error = errno;
  last_byte_ = clock_.now();
  if (answer >= 0) return {};
  return failed(error, fmt::format("{}: {} 0x{:04X}", who(), what, address));
}

Result<void> Client::open() {
  context_.reset(modbus_new_rtu(options_.device.c_str(), options_.baud, letter(options_.parity), 8, 1));
  if (!context_) {
    return fail(ErrorCode::io, "open {}: {}", options_.device, std::strerror(errno));
  }
  modbus_set_slave(context_.get(), options_.unit_id);
  modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_byte_timeout(context_.get(), 0, 0);  // the response timeout is for the whole reply
  const auto give_up = [&](std::string_view reason) {
    context_.reset();
    ++statistics_.io_errors;
    return fail(ErrorCode::io, "open {}: {}", options_.device, reason);
  };
  if (modbus_connect(context_.get()) != 0) return give_up(std::strerror(errno));
  // libmodbus does not lock: two masters on one line would take each other's replies.
  if (!options_.is_shared && ::flock(modbus_get_socket(context_.get()), LOCK_EX | LOCK_NB) != 0) {
    return give_up(errno == EWOULDBLOCK ? "another program is using it" : std::strerror(errno));
  }
  // libmodbus has a mode of its own, but it sets neither level nor delays, and its set_rts switches RTS from the
  // program, too late for a device that replies at once.
  if (options_.rs485) {
    if (auto used = serial::use_rs485(modbus_get_socket(context_.get()), *options_.rs485); !used) {
      context_.reset();
      ++statistics_.io_errors;
      return pass_on(used, "open " + options_.device);
    }
  }
  finding_ = serial::request_low_latency(modbus_get_socket(context_.get()), options_.device);
  ++statistics_.openings;
  reply_missed_ = true;  // earlier data of the device are not for this request
  return {};
}

Result<void> Client::wait_until_quiet(Deadline deadline) {
  const auto silence = 2 * options_.reply_timeout;
  const int port = modbus_get_socket(context_.get());
  for (auto quiet_at = clock_.now() + silence; clock_.now() < quiet_at;) {
    if (deadline.expired(clock_)) {
      return fail(ErrorCode::timeout, "{}: bus not quiet in time", who());
    }
    if (fail_fast_) return fail(ErrorCode::stopped, "{}: cancelled while waiting for a quiet bus", who());
    const Heard heard = discard(port, std::min({quiet_at - clock_.now(), deadline.left(clock_), kLook}));
    if (heard == Heard::hangup) return failed(EIO, who());
    if (heard == Heard::something) quiet_at = clock_.now() + silence;
  }
  reply_missed_ = false;
  return {};
}

Result<void> Client::failed(int error, const std::string& request) {
  reply_missed_ = !refused(error) || error == kDeviceSawWrongCrc;
  if (port_lost(error)) {
    context_.reset();
    ++statistics_.io_errors;
    return fail(ErrorCode::io, "{}: the port is gone ({}); check the cable and the adapter", request,
                std::strerror(error));
  }
  if (error == ETIMEDOUT) {
    ++statistics_.timeouts;
    return fail(ErrorCode::timeout, "{}: no complete reply within {} ms; check power, wiring, baud and unit id{}",
                request, options_.reply_timeout.count(), finding_ ? "; " + *finding_ : "");
  }
  if (refused(error)) {
    ++statistics_.refused;
    return fail(ErrorCode::protocol, "{}: the device refused: {}", request,
                error == kDeviceSawWrongCrc ? "it saw a wrong checksum" : modbus_strerror(error));
  }
  ++statistics_.corrupt;
  return fail(ErrorCode::protocol, "{}: unusable answer: {}", request, modbus_strerror(error));
}

}  // namespace scanrig::modbus
