#pragma once

#include <filesystem>
#include <vector>

#include "config/rig_config.h"
#include "config/section.h"

namespace scanrig::config {

/// Port, speed, parity, unit and reply timeout of a Modbus device.
void read_modbus_line(Section& s, modbus::ClientOptions& line);

/// [turntable], with the drive profile it names from one of the folders.
void read_turntable(Section& s, const std::vector<std::filesystem::path>& drive_folders, TurntableConfig& turntable);

}  // namespace scanrig::config
