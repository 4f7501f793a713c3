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

Result<std::unique_ptr<Turntable>> open_turntable(const config::TurntableConfig& config, Clock& clock) {
  auto turntable = ModbusTurntable::create(config.modbus, clock);
  if (!turntable) return pass_on(turntable);
  return std::move(*turntable);
}

Result<std::unique_ptr<Projector>> open_projector(const config::ProjectorConfig& config) {
  return not_yet("projector", name_of(config.driver));
}

}  // namespace

Result<OpenDevices> open_devices(const config::RigConfig& config, Clock& clock) {
  OpenDevices open;
  auto turntable = open_turntable(config.turntable, clock);
  if (!turntable) return pass_on(turntable);
  open.turntable = std::move(*turntable);
  auto projector = open_projector(config.projector);
  if (!projector) return pass_on(projector);
  open.projector = std::move(*projector);
  return open;
}

}  // namespace scanrig
