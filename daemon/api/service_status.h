#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

struct Temperature {
  std::string sensor;  ///< the kernel's name of it
  double celsius = 0.0;
};

/// What the API knows beside the station.
struct ServiceStatus {
  double uptime_s = 0.0;
  std::uint64_t disk_bytes = 0, disk_free_bytes = 0;  ///< where jobs are kept; 0: not known
  std::vector<Temperature> temperatures{};            ///< empty where the machine has no sensors
  std::optional<Error> tokens_problem{};              ///< why no token is accepted
  std::size_t connections = 0, event_streams = 0;
  std::uint64_t requests = 0, refused = 0;  ///< refused: by role, token or limits
};

/// Disk and temperatures as they are now. Touches the disk.
ServiceStatus read_machine(const std::filesystem::path& storage);

}  // namespace scanrig
