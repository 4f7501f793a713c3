#pragma once

#include "config/rig_config.h"
#include "daemon/service/run_daemon.h"

namespace scanrig {

/// What a rig's configuration says about the daemon.
DaemonOptions options_from(const config::RigConfig& config);

}  // namespace scanrig
