#pragma once

#include <memory>

#include "config/rig_config.h"
#include "core/clock.h"
#include "daemon/rig/devices.h"

namespace scanrig {

/// The devices of a real rig, opened.
struct OpenDevices {
  std::unique_ptr<Turntable> turntable;
  std::unique_ptr<Projector> projector;
  std::unique_ptr<StereoCamera> camera;
  std::unique_ptr<Panel> panel;

  [[nodiscard]] Devices devices() const { return {*turntable, *projector, *camera, *panel}; }
};

/// Opens what the configuration names. Fails with `unsupported` for a driver that this version does not have, and as
/// the drivers do.
Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock);

}  // namespace scanrig
