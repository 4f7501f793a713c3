#pragma once

#include "config/rig_config.h"
#include "drivers/panel/gpio_panel.h"
#include "drivers/panel/modbus_io_panel.h"
#include "drivers/projector/camera_strobe_projector.h"
#include "drivers/projector/gpio_projector.h"
#include "drivers/projector/modbus_io_projector.h"

namespace scanrig::config {

/// For a rig whose [projector] driver is "gpio".
GpioProjectorOptions gpio_projector_options(const ProjectorConfig& projector);

/// For a rig whose [projector] driver is "modbus-io".
ModbusIoProjectorOptions modbus_io_projector_options(const ProjectorConfig& projector);

/// For a rig whose [projector] driver is "camera-strobe".
CameraStrobeProjectorOptions camera_strobe_options(const RigConfig& rig);

/// For a rig whose [panel] driver is "modbus-io".
ModbusIoPanelOptions modbus_io_panel_options(const RigConfig& rig);

/// For a rig whose [panel] driver is "gpio"; the e-stop and guard inputs of [safety] belong to the panel.
GpioPanelOptions gpio_panel_options(const RigConfig& rig);

}  // namespace scanrig::config
