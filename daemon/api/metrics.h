#pragma once

#include <string>

#include "daemon/api/service_status.h"
#include "daemon/station/snapshot.h"

namespace scanrig {

/// Metrics in the text format 0.0.4 of Prometheus. Names start with scanrig_, units are base units.
std::string metrics_text(const Snapshot& snapshot, const ServiceStatus& facts);

}  // namespace scanrig
