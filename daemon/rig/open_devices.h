#pragma once

#include <functional>
#include <memory>

#include "config/rig_config.h"
#include "core/clock.h"
#include "daemon/rig/devices.h"
#include "drivers/camera/sensor_camera.h"
#include "drivers/gpio/lines.h"

namespace scanrig {

/// The devices of a real rig. A missing device fails at every use until it responds. Nothing else is affected, and no
/// restart is needed.
struct OpenDevices {
  std::unique_ptr<gpio::Lines> lines;
  std::unique_ptr<Turntable> turntable;
  std::unique_ptr<Projector> projector;
  std::unique_ptr<SensorCamera> camera;  ///< null for simulated ones: their owner has them
  std::unique_ptr<Panel> panel;

  [[nodiscard]] Devices devices() const { return {*turntable, *projector, *camera, *panel}; }
};

/// `config` outlives the devices. Fails with `out_of_range` for a turntable or projector that cannot do what the
/// configuration requires.
Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock);

/// Single devices, for callers that need no more. `config` and `lines` outlive them. Fail with `out_of_range`.
std::unique_ptr<gpio::Lines> open_lines(const config::RigConfig& config, Clock& clock);
Result<std::unique_ptr<Turntable>> open_turntable(const config::TurntableConfig& config, Clock& clock);
/// Also fails with `unsupported`, for a projector that only a camera fires.
Result<std::unique_ptr<Projector>> open_projector(const config::ProjectorConfig& config, gpio::Lines& lines,
                                                  Clock& clock);
std::unique_ptr<Panel> open_panel(const config::RigConfig& config, gpio::Lines& lines, Clock& clock);

/// Time a reading of the panel may take beyond its deadline, for PanelThreadOptions: 0 unless it is a module on a
/// bus.
Clock::Duration panel_read_time(const config::PanelConfig& config);

}  // namespace scanrig
