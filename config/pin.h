#pragma once

#include <map>
#include <string>
#include <string_view>

#include "config/rig_config.h"
#include "config/section.h"

namespace scanrig::config {

/// How a signal is wired.
enum class Wiring { gpio_input, gpio_output, channel };

/// { line = "NAME" } or { chip = "gpiochip0", offset = 17 }, with `bias` for an input; { channel = 3 } of a Modbus I/O
/// module. `active` is optional: active high unless it is "low".
Pin read_pin(Section& section, std::string_view key, Wiring wiring);

/// A GPIO output: its name as a text, or { chip = ..., offset = ... }.
Pin read_output_line(Section& section, std::string_view key);

/// Two signals on one contact would hide each other. Compares with `others`, which are not compared with one another.
void report_shared(Section& s, const std::map<std::string, Pin>& pins, const std::map<std::string, Pin>& others);

}  // namespace scanrig::config
