#pragma once

#include <functional>
#include <memory>

#include "config/rig_config.h"
#include "core/clock.h"
#include "daemon/rig/devices.h"
#include "drivers/gpio/lines.h"

namespace scanrig {

/// The devices of a real rig. A projector, panel or camera that cannot be opened, or that this version has no driver
/// for, fails at every use until it can; the turntable's driver does that by itself.
struct OpenDevices {
  std::unique_ptr<gpio::Lines> lines;
  std::unique_ptr<Turntable> turntable;
  std::unique_ptr<Projector> projector;
  std::unique_ptr<StereoCamera> camera;
  std::unique_ptr<Panel> panel;

  [[nodiscard]] Devices devices() const { return {*turntable, *projector, *camera, *panel}; }
};

/// `config` outlives the devices. Fails with `out_of_range` for a turntable that cannot do what it is asked for.
Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock);

}  // namespace scanrig
