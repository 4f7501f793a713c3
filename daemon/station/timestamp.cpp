#include "daemon/station/timestamp.h"

#include <fmt/chrono.h>

namespace scanrig {

std::string iso_time(std::chrono::system_clock::time_point when) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(when)));
}

std::string job_id(std::chrono::system_clock::time_point when, int serial) {
  return fmt::format("{:%Y%m%d-%H%M%S}-{}", fmt::gmtime(std::chrono::system_clock::to_time_t(when)), serial);
}

}  // namespace scanrig
