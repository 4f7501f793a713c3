#include "daemon/rig/open_devices.h"

#include "config/gpio_options.h"
#include "daemon/rig/devices.h"
#include "drivers/camera/aravis_stereo_camera.h"
#include "drivers/camera/v4l2_stereo_camera.h"
#include "drivers/panel/gpio_panel.h"
#include "drivers/panel/modbus_io_panel.h"
#include "drivers/projector/camera_strobe_projector.h"
#include "drivers/projector/gpio_projector.h"
#include "drivers/projector/lightcrafter_projector.h"
#include "drivers/projector/manual_projector.h"
#include "drivers/projector/modbus_io_projector.h"
#include "drivers/turntable/grbl_turntable.h"
#include "drivers/turntable/modbus_turntable.h"

namespace scanrig {

/// The only place where a turntable's driver is chosen.
Result<std::unique_ptr<Turntable>> open_turntable(const config::TurntableConfig& config, Clock& clock) {
  const auto made = [](auto turntable) -> Result<std::unique_ptr<Turntable>> {
    if (!turntable) return pass_on(turntable);
    return std::move(*turntable);
  };
  if (config.driver == config::TurntableConfig::Driver::grbl) return made(GrblTurntable::create(config.grbl, clock));
  return made(ModbusTurntable::create(config.modbus, clock));
}

std::unique_ptr<gpio::Lines> open_lines(const config::RigConfig& config, Clock& clock) {
  return config.gpio_socket ? gpio::socket_lines(*config.gpio_socket, clock) : gpio::chip_lines(clock);
}

/// A LightCrafter and an I/O module connect at their first use; GPIO lines are opened then.
Result<std::unique_ptr<Projector>> open_projector(const config::ProjectorConfig& config, gpio::Lines& lines,
                                                  Clock& clock) {
  using Driver = config::ProjectorConfig::Driver;
  if (config.driver == Driver::manual) return std::make_unique<ManualProjector>();
  if (config.driver == Driver::camera_strobe) {
    return fail(ErrorCode::unsupported, "projector: is fired by a camera; it has no connection of its own");
  }
  if (config.driver == Driver::modbus_io) {
    return std::make_unique<ModbusIoProjector>(config::modbus_io_projector_options(config), clock);
  }
  if (config.driver == Driver::lightcrafter4500) {
    auto projector =
        LightCrafterProjector::create(config.lightcrafter, dlpc350::usb_transport(config.serial, clock), clock);
    if (!projector) return pass_on(projector);
    return std::move(*projector);
  }
  return std::make_unique<AutoReopenProjector>([&config, &lines, &clock]() -> Result<std::unique_ptr<Projector>> {
    auto projector = GpioProjector::open(config::gpio_projector_options(config), lines, clock);
    if (!projector) return pass_on(projector);
    return std::move(*projector);
  });
}

namespace {

/// The cameras connect at their first use. Null for simulated ones.
std::unique_ptr<SensorCamera> make_camera(const config::StereoCameraConfig& config, Clock& clock) {
  using Driver = config::StereoCameraConfig::Driver;
  switch (config.driver) {
    case Driver::aravis: return aravis_camera(config.aravis, clock);
    case Driver::v4l2:
    case Driver::v4l2_side_by_side: return v4l2_camera(config.v4l2, kernel_video(), clock);
    case Driver::simulated: break;
  }
  return nullptr;
}

/// `camera` is null for simulated cameras.
Result<std::unique_ptr<Projector>> make_projector(const config::RigConfig& config, SensorCamera* camera,
                                                  gpio::Lines& lines, Clock& clock) {
  CameraStrobe* const strobe = camera ? camera->strobe() : nullptr;
  if (strobe && config.projector.driver == config::ProjectorConfig::Driver::camera_strobe) {
    return std::make_unique<CameraStrobeProjector>(config::camera_strobe_options(config), *strobe, clock);
  }
  return open_projector(config.projector, lines, clock);
}

Result<std::unique_ptr<Panel>> wired_panel(const config::RigConfig& config, gpio::Lines& lines, Clock& clock) {
  if (config.panel.driver == config::PanelConfig::Driver::modbus_io) {
    return std::make_unique<ModbusIoPanel>(config::modbus_io_panel_options(config), clock);
  }
  auto panel = GpioPanel::open(config::gpio_panel_options(config), lines, clock);
  if (!panel) return pass_on(panel);
  return std::move(*panel);
}

}  // namespace

std::unique_ptr<Panel> open_panel(const config::RigConfig& config, gpio::Lines& lines, Clock& clock) {
  return std::make_unique<AutoReopenPanel>([&config, &lines, &clock] { return wired_panel(config, lines, clock); });
}

Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock) {
  auto turntable = open_turntable(config.turntable, clock);
  if (!turntable) return pass_on(turntable);
  OpenDevices open;
  open.lines = open_lines(config, clock);
  open.turntable = std::move(*turntable);
  gpio::Lines& lines = *open.lines;
  auto camera = make_camera(config.stereo_camera, clock);
  auto projector = make_projector(config, camera.get(), lines, clock);
  if (!projector) return pass_on(projector);
  open.projector = std::move(*projector);
  open.panel = open_panel(config, lines, clock);
  open.camera = std::move(camera);
  return open;
}

/// Sum for a module's bus: wait for the next polling, then read coils and inputs. One reply is missed, the bus is left
/// quiet for two reply timeouts, and both are read again (drivers/panel/modbus_io_panel.h).
Clock::Duration panel_read_time(const config::PanelConfig& config) {
  if (config.driver != config::PanelConfig::Driver::modbus_io) return Clock::Duration::zero();
  constexpr int kReplyTimeouts = 1 + 2 + 2;
  return config.poll + kReplyTimeouts * config.io_module.reply_timeout;
}

}  // namespace scanrig
