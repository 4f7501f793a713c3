#include "daemon/rig/open_devices.h"

#include "config/gpio_options.h"
#include "daemon/rig/retried_devices.h"
#include "drivers/panel/gpio_panel.h"
#include "drivers/panel/modbus_io_panel.h"
#include "drivers/projector/gpio_projector.h"
#include "drivers/projector/manual_projector.h"
#include "drivers/turntable/grbl_turntable.h"
#include "drivers/turntable/modbus_turntable.h"

namespace scanrig {
namespace {

tl::unexpected<Error> not_yet(const char* section, std::string_view driver) {
  return fail(ErrorCode::unsupported, "[{}] driver = \"{}\": this version of scanrigd has no such driver", section,
              driver);
}

std::string_view name_of(config::ProjectorConfig::Driver driver) {
  switch (driver) {
    case config::ProjectorConfig::Driver::gpio: return "gpio";
    case config::ProjectorConfig::Driver::lightcrafter4500: return "lightcrafter4500";
    case config::ProjectorConfig::Driver::manual: return "manual";
  }
  return "unknown";
}

std::string_view name_of(config::StereoCameraConfig::Driver driver) {
  switch (driver) {
    case config::StereoCameraConfig::Driver::aravis: return "aravis";
    case config::StereoCameraConfig::Driver::v4l2: return "v4l2";
    case config::StereoCameraConfig::Driver::v4l2_side_by_side: return "v4l2-side-by-side";
    case config::StereoCameraConfig::Driver::simulated: return "simulated";
  }
  return "unknown";
}

/// The one place where a turntable's driver is chosen.
Result<std::unique_ptr<Turntable>> make_turntable(const config::TurntableConfig& config, Clock& clock) {
  const auto made = [](auto turntable) -> Result<std::unique_ptr<Turntable>> {
    if (!turntable) return pass_on(turntable);
    return std::move(*turntable);
  };
  if (config.driver == config::TurntableConfig::Driver::grbl) return made(GrblTurntable::create(config.grbl, clock));
  return made(ModbusTurntable::create(config.modbus, clock));
}

Result<std::unique_ptr<Projector>> open_projector(const config::ProjectorConfig& config, gpio::Lines& lines,
                                                  Clock& clock) {
  using Driver = config::ProjectorConfig::Driver;
  if (config.driver == Driver::manual) return std::make_unique<ManualProjector>();
  if (config.driver != Driver::gpio) return not_yet("projector", name_of(config.driver));
  auto projector = GpioProjector::open(config::gpio_projector_options(config), lines, clock);
  if (!projector) return pass_on(projector);
  return std::move(*projector);
}

Result<std::unique_ptr<Panel>> open_panel(const config::RigConfig& config, gpio::Lines& lines, Clock& clock) {
  if (config.panel.driver == config::PanelConfig::Driver::modbus_io) {
    return std::make_unique<ModbusIoPanel>(config::modbus_io_panel_options(config), clock);
  }
  auto panel = GpioPanel::open(config::gpio_panel_options(config), lines, clock);
  if (!panel) return pass_on(panel);
  return std::move(*panel);
}

}  // namespace

Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock) {
  auto turntable = make_turntable(config.turntable, clock);
  if (!turntable) return pass_on(turntable);
  OpenDevices open;
  open.lines = config.gpio_socket ? gpio::socket_lines(*config.gpio_socket, clock) : gpio::chip_lines(clock);
  open.turntable = std::move(*turntable);
  gpio::Lines& lines = *open.lines;
  open.projector = std::make_unique<RetriedProjector>(
      [&config, &lines, &clock] { return open_projector(config.projector, lines, clock); });
  open.panel = std::make_unique<RetriedPanel>([&config, &lines, &clock] { return open_panel(config, lines, clock); });
  open.camera = std::make_unique<RetriedCamera>([&config]() -> Result<std::unique_ptr<StereoCamera>> {
    return not_yet("stereo_camera", name_of(config.stereo_camera.driver));
  });
  return open;
}

}  // namespace scanrig
