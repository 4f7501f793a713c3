#pragma once

#include <optional>
#include <string>

#include "core/clock.h"
#include "drivers/modbus/client.h"

namespace scanrig::ctl::doctor {

/// Asks a GRBL controller on `device` for its state (one harmless character at 115200 8N1); what it said, or nothing.
std::optional<std::string> grbl_answer(const std::string& device, Clock& clock);

/// A Modbus device that answers, and how it wants to be spoken to.
struct ModbusAnswer {
  modbus::ClientOptions line;
  bool knows_register = false;  ///< it has the register that was asked for
};

/// Looks for a Modbus device on the port of `configured`: with its settings, then with other parities, speeds and unit
/// ids up to `max_unit`, by reading `address`. The first that answers, even with a refusal; about 6 s when none does.
std::optional<ModbusAnswer> find_modbus(const modbus::ClientOptions& configured, std::uint16_t address, int max_unit,
                                        Clock& clock);

std::string_view word(modbus::Parity parity);

}  // namespace scanrig::ctl::doctor
