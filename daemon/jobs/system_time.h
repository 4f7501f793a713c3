#pragma once

#include <chrono>
#include <memory>
#include <stop_token>

namespace scanrig {

/// The clocks of the machine at one moment.
struct TimeReading {
  std::chrono::system_clock::time_point wall{};
  bool is_synchronized = false;  ///< `wall` follows a time server
  std::chrono::seconds running{
      0};  ///< of the machine since it was switched on; only ever counts up until the next time
};

/// Source of time for retention. Threads: one user.
class SystemTime {
 public:
  virtual ~SystemTime() = default;
  /// May take seconds, less where `stop` is requested.
  [[nodiscard]] virtual TimeReading read(const std::stop_token& stop) const = 0;
};

/// The kernel's clocks. Synchronized means the same as in `timedatectl`, whichever program sets the time.
std::shared_ptr<const SystemTime> system_time();

}  // namespace scanrig
