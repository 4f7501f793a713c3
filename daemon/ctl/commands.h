#pragma once

#include <functional>

#include "core/result.h"

namespace CLI {
class App;
}

namespace scanrig::ctl {

/// The verb that was asked for; set while the command line is read.
using Chosen = std::function<ExitCode()>;

// The one description of the command line: parsing, help, completion and manual pages are all made from it.
void add_station_commands(CLI::App& app, Chosen& chosen);  ///< status, start, stop, ...: clients of the daemon
void add_job_commands(CLI::App& app, Chosen& chosen);      ///< jobs, export, ...: clients of the daemon
void add_offline_commands(CLI::App& app, Chosen& chosen);  ///< reconstruct, evaluate, check-config, token, ...
void add_rig_commands(CLI::App& app, Chosen& chosen);      ///< at the rig, while no daemon runs
void add_pages_command(CLI::App& app, Chosen& chosen);     ///< hidden: writes completion and manual pages

}  // namespace scanrig::ctl
