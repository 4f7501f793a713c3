#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "core/result.h"

namespace scanrig::serial {

/// Direction of a half-duplex RS-485 transceiver that RTS switches, by the kernel's driver of the port
/// [linux, serial-rs485.rst]. For ports that do not switch it by themselves, as most adapters do.
struct Rs485 {
  bool high_while_sending = true;       ///< level of RTS while this side sends; the other level while it receives
  std::chrono::milliseconds before{0};  ///< from switching to the first bit
  std::chrono::milliseconds after{0};   ///< from the last bit to switching back
};

/// ioctl of man 2, for tests to script.
using PortControl = std::function<int(int descriptor, unsigned long request, void* argument)>;
PortControl kernel_port_control();

/// Makes the kernel switch the direction and reads back what it made of `options`. Fails with `unsupported` (the
/// port's driver has no RS-485, or not this level or delay), `io`.
Result<void> use_rs485(int descriptor, const Rs485& options, const PortControl& control = kernel_port_control());

/// Asks the adapter behind an open port to pass bytes on at once, for which no privilege is needed. FTDI adapters keep
/// them for 16 ms otherwise. A port that has no such setting is left as it is. Returns a sentence with the remedy when
/// the adapter still waits, by /sys below `root`.
std::optional<std::string> request_low_latency(int descriptor, const std::string& device,
                                               const PortControl& control = kernel_port_control(),
                                               const std::string& root = "");

}  // namespace scanrig::serial
