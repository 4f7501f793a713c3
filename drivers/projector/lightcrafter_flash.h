#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "drivers/projector/lightcrafter_link.h"

namespace scanrig::dlpc350 {

/// Version of a firmware file, as TI's control software writes it with the images that patterns are made of.
/// Fails with `invalid_input` (no such file's content), `unsupported` (older than kOldestFirmware).
Result<Version> check_firmware_file(std::span<const std::uint8_t> file);

/// `step`: "erase", "write", "check"; `share`: of it, 0 to 1.
using OnFlashProgress = std::function<void(std::string_view step, double share)>;

/// Writes `file` into the device's flash, but for the bootloader's sector, compares checksums, restarts the device and
/// returns its version. An interruption leaves the bootloader, which takes the next load.
/// Fails with `invalid_input`, `unsupported` (the file; a device with another flash), `not_found`, `io`, `timeout`,
/// `protocol` (the flash differs from the file). Needs minutes.
Result<Version> load_firmware(std::span<const std::uint8_t> file, const OpenTransport& open,
                              const OnFlashProgress& on_progress, Clock& clock, Deadline deadline);

}  // namespace scanrig::dlpc350
