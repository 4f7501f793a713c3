#pragma once

#include "config/rig_config.h"
#include "daemon/service/run_daemon.h"

namespace scanrig {

/// Options of the daemon from a rig's configuration.
DaemonOptions options_from(const config::RigConfig& config);

}  // namespace scanrig
