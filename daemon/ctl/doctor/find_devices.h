#pragma once

#include <optional>
#include <string>

#include "core/clock.h"
#include "drivers/modbus/client.h"

namespace scanrig::ctl::doctor {

/// Requests the state of a GRBL controller on `device` (one harmless character at 115200 8N1); its reply, or nothing.
std::optional<std::string> grbl_answer(const std::string& device, Clock& clock);

/// A Modbus device that responds, and the settings it needs.
struct ModbusAnswer {
  modbus::ClientOptions line;
  bool knows_register = false;  ///< it has the requested register
};

/// Looks for a Modbus device on the port of `configured`: with its settings, then with other parities, speeds and unit
/// ids up to `max_unit`, by reading `address`. The first that responds, even with a refusal; about 6 s without any.
std::optional<ModbusAnswer> find_modbus(const modbus::ClientOptions& configured, std::uint16_t address, int max_unit,
                                        Clock& clock);

std::string_view word(modbus::Parity parity);

}  // namespace scanrig::ctl::doctor
