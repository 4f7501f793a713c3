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

/// Where retention gets the time from. Threads: one user.
class SystemTime {
 public:
  virtual ~SystemTime() = default;
  /// May take seconds, less where `stop` is requested.
  [[nodiscard]] virtual TimeReading read(const std::stop_token& stop) const = 0;
};

/// The kernel's clocks. Synchronized means what `timedatectl` calls so, whichever program keeps the time.
std::shared_ptr<const SystemTime> system_time();

}  // namespace scanrig
