#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "drivers/modbus/client.h"
#include "drivers/turntable/drive_profile.h"

namespace scanrig::discovery {

/// Serial ports of this machine, each once, under its most lasting name: by the adapter's serial number
/// (`dev`/serial/by-id) where it has one, else ttyUSB* and ttyACM*.
std::vector<std::string> serial_ports(const std::filesystem::path& dev = "/dev");

/// Requests the state of a GRBL controller on `device` (one harmless character at 115200 8N1); its reply, or nothing.
std::optional<std::string> grbl_answer(const std::string& device, Clock& clock);

/// What a Modbus device is recognised by: something that it can read.
struct ModbusTrait {
  enum class Table { registers, inputs };
  Table table = Table::registers;
  std::uint16_t address = 0;
};

/// A Modbus device that responds, and the settings it needs.
struct ModbusAnswer {
  modbus::ClientOptions line;
  bool has_trait = false;
};

/// Looks for a Modbus device on the port of `configured`: with its settings, then with other parities, speeds and unit
/// ids up to `max_unit`, by reading `trait`. The first that responds, even with a refusal; about 6 s without any.
std::optional<ModbusAnswer> find_modbus(const modbus::ClientOptions& configured, ModbusTrait trait, int max_unit,
                                        Clock& clock);

/// What responds at a serial port.
struct SerialDevice {
  enum class Kind { grbl, drive, io_module, unknown };
  Kind kind = Kind::unknown;
  modbus::ClientOptions line;         ///< how it responds; of `grbl` only device and baud
  std::vector<std::string> profiles;  ///< of `drive`: names of the profiles whose registers it has; one at least
  std::string answer;                 ///< of `grbl`
};

/// Asks with harmless readings only: nothing is written but GRBL's "?". Nothing if nothing responds, or the port cannot
/// be used; up to 7 s. A drive is recognised by the status, position and resolution registers of a profile, a module by
/// its discrete inputs.
std::optional<SerialDevice> find_serial_device(const std::string& device,
                                               const std::map<std::string, DriveProfile>& profiles, Clock& clock);

std::string_view word(modbus::Parity parity);

}  // namespace scanrig::discovery
