#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/line_settings.h"
#include "sim/wire/modbus_frame.h"
#include "sim/wire/pty.h"
#include "sim/wire/wire_fault.h"

namespace scanrig::sim::wire {

/// One frame, as it passed the far end of the wire.
struct WireFrame {
  Clock::TimePoint at;
  bool from_master = false;
  Bytes bytes;
};

/// A device on a pseudo-terminal, in a thread of its own. The device's state changes before its reply.
/// Threads: every function may be called from any thread.
class WireServer {
 public:
  virtual ~WireServer() = default;

  void inject(const WireFault& fault);
  void clear_faults();
  /// Settings of the device's own port: it receives only requests of a client with the same ones. Before the first
  /// call any will do.
  void set_line(const LineSettings& settings);
  /// Pulls the adapter, and plugs it in again (fails with `io`).
  void vanish();
  Result<void> come_back();

  [[nodiscard]] std::vector<WireFrame> log() const;
  void clear_log();

 protected:
  WireServer(std::filesystem::path link, Clock& clock) : link_(std::move(link)), clock_(clock) {}

  /// Serves the line until stopped. A derived class calls vanish() in its destructor.
  virtual void serve(const std::stop_token& stop, Pty& pty) = 0;

  void note(bool from_master, const Bytes& bytes);
  std::optional<WireFault> next_fault(std::uint8_t function);
  /// Sends the reply to a request, changed by the fault.
  void send(const std::stop_token& stop, Pty& pty, Bytes reply, const std::optional<WireFault>& fault);

  Clock& clock() { return clock_; }

 private:
  const std::filesystem::path link_;
  Clock& clock_;

  mutable std::mutex mutex_;
  std::deque<WireFault> faults_;
  std::optional<LineSettings> line_;
  std::vector<WireFrame> log_;
  Bytes last_reply_;  // server's thread only

  std::mutex port_mutex_;
  std::optional<Pty> pty_;
  std::jthread thread_;
};

}  // namespace scanrig::sim::wire
