#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/rig_config.h"
#include "config/setup/dialogue.h"
#include "core/clock.h"
#include "drivers/discovery/serial_devices.h"

namespace scanrig::config::setup {

/// Buttons, contacts and lamps, and by what they are connected.
struct PanelWiring {
  PanelConfig panel;
  Pin estop;
  std::optional<Pin> guard;
  std::map<std::string, Pin> lights;  ///< outputs for the projector: "pattern", "plain"
};

/// GPIO lines by their names in config/rigs/example.toml; or an I/O module, where the person presses one button after
/// the other and names the lamps. Fails with `not_found` (neither, or a line or button that a rig needs), `refused`,
/// and as the module.
Result<PanelWiring> find_panel(gpio::Lines& lines, const std::vector<discovery::SerialDevice>& modules,
                               const Dialogue& dialogue, Clock& clock);

}  // namespace scanrig::config::setup
