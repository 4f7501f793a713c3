#pragma once

#include <filesystem>
#include <optional>

namespace scanrig::sim::wire {

enum class Parity { none, even, odd };

/// How a serial port is set.
struct LineSettings {
  int baud = 115200;
  Parity parity = Parity::none;
  bool operator==(const LineSettings&) const = default;
};

/// How the program that opened the pseudo-terminal `port` has set it; nothing when it cannot be asked. A
/// pseudo-terminal drops the parity bit itself but keeps the wish to check it, which is what is looked at.
std::optional<LineSettings> line_settings(const std::filesystem::path& port);

}  // namespace scanrig::sim::wire
