#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>

#include "core/result.h"
#include "sim/wire/modbus_frame.h"

namespace scanrig::sim::wire {

/// The far end of a serial line: the master side of a pseudo-terminal, with a symbolic link to the side that a driver
/// opens. Closing it equals pulling the adapter: the link disappears and the driver's descriptor hangs up.
/// Threads: one user at a time.
class Pty {
 public:
  /// Fails with `io`.
  static Result<Pty> open(const std::filesystem::path& link);
  Pty(Pty&& other) noexcept;
  Pty& operator=(Pty&&) = delete;
  ~Pty();

  /// Bytes that arrive within `wait`; empty without any.
  Bytes read(std::chrono::milliseconds wait);
  void write(std::span<const std::uint8_t> bytes);

 private:
  Pty(int master, std::filesystem::path link) : master_(master), link_(std::move(link)) {}

  int master_;
  int slave_ = -1;  // kept open, or the master side hangs up while no driver has the port open
  std::filesystem::path link_;
};

}  // namespace scanrig::sim::wire
