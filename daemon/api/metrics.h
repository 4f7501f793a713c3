#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/station/snapshot.h"

namespace scanrig {

struct Temperature {
  std::string sensor;  ///< the kernel's name for it
  double celsius = 0.0;
};

/// Data that the API has beside the station's.
struct ServiceStatus {
  double uptime_s = 0.0;
  std::uint64_t disk_bytes = 0, disk_free_bytes = 0;  ///< where jobs are kept; 0: unknown
  std::vector<Temperature> temperatures{};            ///< empty where the machine has no sensors
  std::optional<Error> tokens_problem{};              ///< why no token is accepted
  std::size_t connections = 0, event_streams = 0;
  std::uint64_t requests = 0, refused = 0;  ///< refused: by role, token or limits
};

/// Present state of disk and temperatures. Touches the disk.
ServiceStatus read_machine(const std::filesystem::path& storage);

/// Metrics in the text format 0.0.4 of Prometheus. Names start with scanrig_, units are base units.
std::string metrics_text(const Snapshot& snapshot, const ServiceStatus& facts);

}  // namespace scanrig
