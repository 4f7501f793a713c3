#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/serial/line_options.h"

namespace scanrig::serial {

/// A plain serial line, 8N1, raw, held by one program at a time (an advisory lock, as drivers/modbus takes it).
/// Waits in real time. Threads: one owner.
class Port {
 public:
  /// `shared`: the port is used although another, hanging program has it.
  enum class Lock { exclusive, shared };
  /// Fails with `io`: absent, not a terminal, no such speed, or used by another program.
  static Result<Port> open(const std::string& device, int baud, Lock lock = Lock::exclusive);
  Port(Port&& other) noexcept;
  Port& operator=(Port&& other) noexcept;
  ~Port();

  /// Writes all of `bytes`. Fails with `timeout` (the line takes no more within `wait`), `io` (the port is gone).
  Result<void> write(std::string_view bytes, Clock::Duration wait);
  /// Reads bytes as soon as any arrive within `wait`; empty when none do. Fails with `io`.
  Result<std::string> read(Clock::Duration wait);

  /// A setting of the adapter that makes replies late, see request_low_latency(); nothing: none.
  [[nodiscard]] const std::optional<std::string>& finding() const { return finding_; }

 private:
  Port(int descriptor, std::string device) : descriptor_(descriptor), device_(std::move(device)) {}
  /// True if `events` happen within `wait`. Fails with `io`.
  Result<bool> ready(short events, Clock::Duration wait);

  int descriptor_ = -1;
  std::string device_;
  std::optional<std::string> finding_;
};

}  // namespace scanrig::serial
