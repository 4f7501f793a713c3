#pragma once

#include <filesystem>
#include <optional>

namespace scanrig::sim::wire {

enum class Parity { none, even, odd };

/// Settings of a serial port.
struct LineSettings {
  int baud = 115200;
  Parity parity = Parity::none;
  bool operator==(const LineSettings&) const = default;
};

/// Settings made by the program that opened the pseudo-terminal `port`; nothing when they cannot be read. A
/// pseudo-terminal drops the parity bit itself but keeps the setting to check it, which is read here.
std::optional<LineSettings> line_settings(const std::filesystem::path& port);

}  // namespace scanrig::sim::wire
