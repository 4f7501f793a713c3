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
  std::chrono::milliseconds reply_timeout{100};  ///< request sent to its answer received
  serial::Port::Lock lock = serial::Port::Lock::exclusive;
};

/// What happened on the line since it was made.
struct LinkStatistics {
  std::uint64_t requests = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t corrupt = 0;  ///< not to be understood, or the answer to something else
  std::uint64_t refused = 0;  ///< error:N
  std::uint64_t io_errors = 0;
  std::uint64_t retries = 0;
  std::uint64_t openings = 0;
};

/// A GRBL 1.1 controller at the other end of a serial line. Waits in real time, never longer than `reply_timeout` or
/// the deadline; never retries. The port is opened by the first request and again after it was lost. After a missed
/// answer the next request is held back until the line has been silent for twice `reply_timeout`. Every request fails
/// with `timeout`, `protocol` (not understood, or refused: error:N in words), `io`; alarms and restarts are told by the
/// controller when they happen, and kept here until asked for. Threads: one owner; set_fail_fast() from any thread.
class Link {
 public:
  Link(LinkOptions options, Clock& clock) : options_(std::move(options)), clock_(clock) {}

  /// Sends a line, returns once it is answered with ok: queued, not carried out. Fails with `device_alarm`, `not_homed`
  /// (the controller restarted meanwhile) too.
  Result<void> command(std::string_view line, Deadline deadline);
  /// Sends a line whose answer comes when it has been carried out, and is found by listen().
  Result<void> begin(std::string_view line, Deadline deadline);
  /// What is said next within `wait`; nothing when nothing is. Alarms and restarts too.
  Result<std::optional<Line>> listen(Clock::Duration wait);
  /// "?"
  Result<Report> report(Deadline deadline);
  /// A line that no state of the controller carries out, for its answer: what is answered late or repeated cannot be
  /// taken for a report again and again, and what was left of a line by a lost byte is thrown away with it.
  Result<void> probe(Deadline deadline);
  /// "$$"
  Result<std::map<int, double>> settings(Deadline deadline);
  /// A byte that takes effect at once and has no answer: '!', whatever is on the line. Fails with `io`, `timeout`.
  Result<void> at_once(char byte);
  /// 0x18, until it says that it has restarted, which then does not count as a restart.
  Result<void> reset(Deadline deadline);

  /// The last alarm since forgotten; 0: none.
  [[nodiscard]] int alarm() const { return alarm_; }
  void forget_alarm() { alarm_ = 0; }
  /// Whether the controller has restarted since last asked.
  bool restarted() { return std::exchange(restarted_, false); }

  /// While on, no request waits for a quiet line: it fails with `timeout` instead.
  void set_fail_fast(bool on) noexcept { fail_fast_ = on; }
  [[nodiscard]] bool reply_missed() const { return reply_missed_; }
  void count_retry() { ++statistics_.retries; }
  [[nodiscard]] const LinkStatistics& statistics() const { return statistics_; }

 private:
  Result<void> open();
  Result<void> send(std::string_view bytes, Deadline deadline);
  /// Until `wanted` says yes to a line.
  Result<Line> answer(std::string_view to, const std::function<bool(const Line&)>& wanted, Deadline deadline);
  Result<std::optional<Line>> next_line(Clock::Duration wait);
  Result<void> wait_until_quiet(Deadline deadline);
  tl::unexpected<Error> lost(const Error& error);

  LinkOptions options_;
  Clock& clock_;
  std::optional<serial::Port> port_;
  std::string heard_;  // of the line that has not ended
  int alarm_ = 0;
  bool restarted_ = false;
  bool reply_missed_ = false;
  std::atomic<bool> fail_fast_ = false;
  LinkStatistics statistics_;
};

}  // namespace scanrig::grbl
