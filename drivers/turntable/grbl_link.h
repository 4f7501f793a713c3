#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/serial/port.h"
#include "drivers/turntable/grbl_protocol.h"

namespace scanrig::grbl {

struct LinkOptions {
  std::string device;
  int baud = 115200;
  std::chrono::milliseconds reply_timeout{100};  ///< from request sent to its reply received
  serial::Port::Lock lock = serial::Port::Lock::exclusive;
};

/// Counts of line events since construction.
struct LinkStatistics {
  std::uint64_t requests = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t corrupt = 0;  ///< not understood, or the reply to another request
  std::uint64_t refused = 0;  ///< error:N
  std::uint64_t io_errors = 0;
  std::uint64_t retries = 0;
  std::uint64_t openings = 0;
};

/// A controller with GRBL 1.1, grblHAL or FluidNC at the other end of a serial line. Waits in real time, never longer
/// than `reply_timeout` or the deadline; never retries. The port is opened by the first request and again after it was
/// lost. After a missed reply the next request is held back until the line has been silent for twice `reply_timeout`.
/// Every request fails with `timeout`, `protocol` (not understood, or refused: error:N with its text), `io`. The
/// controller reports alarms and restarts when they happen; they are kept until read. Threads: one owner;
/// set_fail_fast() from any thread.
class Link {
 public:
  Link(LinkOptions options, Clock& clock) : options_(std::move(options)), clock_(clock) {}

  /// Sends a line, returns once it is acknowledged with ok: queued, not carried out. Also fails with `device_alarm`,
  /// `not_homed` (the controller restarted meanwhile).
  Result<void> command(std::string_view line, Deadline deadline);
  /// Sends a line whose reply comes when it has been carried out, and is read by listen().
  Result<void> begin(std::string_view line, Deadline deadline);
  /// Reads the next line within `wait`; nothing when there is none. Includes alarms and restarts.
  Result<std::optional<Line>> listen(Clock::Duration wait);
  /// Sends "?".
  Result<Report> report(Deadline deadline);
  /// Sends a line that no state of the controller carries out, for its reply. So a late or repeated reply is not taken
  /// for a report again and again. The rest of a line with a lost byte is discarded with it.
  Result<void> probe(Deadline deadline);
  /// Sends "$I", for firmware(). A controller that does not answer it is taken for GRBL.
  Result<void> identify(Deadline deadline);
  /// As the controller last named it.
  [[nodiscard]] Firmware firmware() const { return firmware_; }
  /// Sends "$$".
  Result<std::map<int, double>> settings(Deadline deadline);
  /// Sends a byte that takes effect at once and has no reply: '!', whatever is on the line. Fails with `io`, `timeout`.
  Result<void> at_once(char byte);
  /// Sends 0x18, waits until the controller reports its restart, which then does not count as a restart.
  Result<void> reset(Deadline deadline);

  /// Last alarm since it was last cleared; 0: none.
  [[nodiscard]] int alarm() const { return alarm_; }
  void forget_alarm() { alarm_ = 0; }
  /// True if the controller has restarted since the last call.
  bool restarted() { return std::exchange(restarted_, false); }

  /// While on, no request waits for a quiet line: it fails with `timeout` instead.
  void set_fail_fast(bool on) noexcept { fail_fast_ = on; }
  [[nodiscard]] bool reply_missed() const { return reply_missed_; }
  void count_retry() { ++statistics_.retries; }
  [[nodiscard]] const LinkStatistics& statistics() const { return statistics_; }

 private:
  Result<void> open();
  Result<void> send(std::string_view bytes, Deadline deadline);
  /// Reads until `wanted` accepts a line.
  Result<Line> answer(std::string_view to, const std::function<bool(const Line&)>& wanted, Deadline deadline);
  Result<std::optional<Line>> next_line(Clock::Duration wait);
  Result<void> wait_until_quiet(Deadline deadline);
  tl::unexpected<Error> lost(const Error& error);

  LinkOptions options_;
  Clock& clock_;
  std::optional<serial::Port> port_;
  std::string heard_;  // start of a line that has not ended
  int alarm_ = 0;
  Firmware firmware_ = Firmware::grbl;
  bool restarted_ = false;
  bool reply_missed_ = false;
  std::atomic<bool> fail_fast_ = false;
  LinkStatistics statistics_;
};

}  // namespace scanrig::grbl
