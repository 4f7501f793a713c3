#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/serial/line_options.h"

struct _modbus;  // libmodbus' context NOLINT(bugprone-reserved-identifier): the library's own name

namespace scanrig::modbus {

enum class Parity { none, even, odd };

struct ClientOptions {
  std::string device;  ///< serial port or pseudo-terminal
  int baud = 115200;
  Parity parity = Parity::none;  ///< one stop bit with even and odd, and with none
  int unit_id = 1;
  std::chrono::milliseconds reply_timeout{60};  ///< from request sent to whole reply received
  std::optional<serial::Rs485> rs485{};         ///< empty: the port switches the direction by itself
  bool is_shared = false;                       ///< the port is used although another, hanging program has it
};

/// Counts of line events since construction; every miss and every retry is visible here.
struct ClientStatistics {
  std::uint64_t requests = 0;
  std::uint64_t timeouts = 0;  ///< no reply, or only part of one
  std::uint64_t corrupt = 0;   ///< wrong checksum, wrong length, reply to another request
  std::uint64_t refused = 0;   ///< Modbus exceptions
  std::uint64_t io_errors = 0;
  std::uint64_t retries = 0;  ///< requests sent again by the layer above, see count_retry()
  std::uint64_t openings = 0;
};

/// One device on a Modbus RTU line, over libmodbus. Waits in real time, never longer than `reply_timeout` or the
/// deadline. Never retries. The port is opened by the first request and again after it was lost.
/// After a missed reply the next request is held back until the line has been silent for twice `reply_timeout`. So a
/// late reply is discarded and not taken for the next one. Every request fails with `timeout` (no whole
/// reply), `protocol` (corrupt, or refused by the device: a Modbus exception), `io` (the port is absent, gone, or used
/// by another program), `unsupported` (the port cannot do what `rs485` says). Threads: one owner.
class Client {
 public:
  Client(ClientOptions options, Clock& clock);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Functions 01 and 02: coils and discrete inputs.
  Result<std::vector<bool>> read_coils(std::uint16_t address, int count, Deadline deadline);
  Result<std::vector<bool>> read_inputs(std::uint16_t address, int count, Deadline deadline);
  /// Functions 05 and 15.
  Result<void> write_coil(std::uint16_t address, bool on, Deadline deadline);
  Result<void> write_coils(std::uint16_t address, const std::vector<bool>& on, Deadline deadline);
  /// Function 03.
  Result<std::vector<std::uint16_t>> read(std::uint16_t address, int count, Deadline deadline);
  /// Function 06.
  Result<void> write(std::uint16_t address, std::uint16_t value, Deadline deadline);
  /// Function 16.
  Result<void> write(std::uint16_t address, std::span<const std::uint16_t> values, Deadline deadline);

  /// Function 06 sent at once, whatever is on the line; its reply is discarded with the rest: for a stop that must not
  /// wait. It may collide with a late reply, so it must be repeated as a request. Fails with `io`.
  Result<void> write_without_reply(std::uint16_t address, std::uint16_t value);

  /// Callable from any thread. While on, no request waits for a quiet line: it fails with `stopped` instead.
  void set_fail_fast(bool on) noexcept { fail_fast_ = on; }

  /// True if the last request was sent, but its reply was missed or corrupt: the device may have acted on it or not.
  [[nodiscard]] bool reply_missed() const { return reply_missed_; }

  /// Called by the layer above when it sends a request again.
  void count_retry() { ++statistics_.retries; }
  [[nodiscard]] const ClientStatistics& statistics() const { return statistics_; }

 private:
  struct Closer {
    void operator()(_modbus* context) const;
  };

  Result<void> request(std::string_view what, std::uint16_t address, Deadline deadline,
                       const std::function<int(_modbus*)>& exchange);
  Result<void> open();
  Result<void> wait_until_quiet(Deadline deadline);
  Result<void> failed(int error, const std::string& request);
  [[nodiscard]] std::string who() const;

  ClientOptions options_;
  Clock& clock_;
  std::unique_ptr<_modbus, Closer> context_;  // null while the port is not open
  bool reply_missed_ = false;
  std::atomic<bool> fail_fast_ = false;
  Clock::TimePoint last_byte_;
  ClientStatistics statistics_;
  std::optional<std::string> finding_;  // a problem of the adapter, see request_low_latency()
};

}  // namespace scanrig::modbus
