#include "daemon/rig/open_devices.h"

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
  }
  return "unknown";
}

std::string_view name_of(config::PanelConfig::Driver driver) {
  return driver == config::PanelConfig::Driver::gpio ? "gpio" : "modbus-io";
}

Result<std::unique_ptr<Turntable>> open_turntable(const config::TurntableConfig& config, Clock& clock) {
  auto turntable = ModbusTurntable::create(config.modbus, clock);
  if (!turntable) return pass_on(turntable);
  return std::move(*turntable);
}

Result<std::unique_ptr<Projector>> open_projector(const config::ProjectorConfig& config) {
  return not_yet("projector", name_of(config.driver));
}

Result<std::unique_ptr<StereoCamera>> open_camera(const config::StereoCameraConfig& config) {
  return not_yet("stereo_camera", name_of(config.driver));
}

Result<std::unique_ptr<Panel>> open_panel(const config::PanelConfig& config) {
  return not_yet("panel", name_of(config.driver));
}

}  // namespace

Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock) {
  auto turntable = open_turntable(config.turntable, clock);
  if (!turntable) return pass_on(turntable);
  auto projector = open_projector(config.projector);
  if (!projector) return pass_on(projector);
  auto camera = open_camera(config.stereo_camera);
  if (!camera) return pass_on(camera);
  auto panel = open_panel(config.panel);
  if (!panel) return pass_on(panel);
  return OpenDevices{std::move(*turntable), std::move(*projector), std::move(*camera), std::move(*panel)};
}

}  // namespace scanrig
