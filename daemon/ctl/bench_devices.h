#pragma once

#include <filesystem>
#include <memory>

#include "config/rig_config.h"
#include "core/clock.h"
#include "core/result.h"
#include "drivers/gpio/lines.h"
#include "drivers/panel/panel.h"
#include "drivers/turntable/turntable.h"

namespace scanrig::ctl {

/// The configuration of a rig that no daemon has its hands on. Fails with `refused` when one answers at its socket,
/// otherwise as read_rig_config().
Result<config::RigConfig> free_rig(const std::filesystem::path& file);

/// Single devices of the rig, without the daemon. Fail as the drivers do.
Result<std::unique_ptr<Turntable>> bench_turntable(const config::RigConfig& rig, Clock& clock);

/// A panel with the lines it is made of.
struct BenchPanel {
  std::unique_ptr<gpio::Lines> lines;
  std::unique_ptr<Panel> panel;
};
Result<BenchPanel> bench_panel(const config::RigConfig& rig, Clock& clock);

/// True when the person at the terminal says yes to `question`, or `yes` was given on the command line.
bool agreed(const std::string& question, bool yes);

}  // namespace scanrig::ctl
