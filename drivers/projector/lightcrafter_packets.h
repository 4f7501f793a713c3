#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"

// The packets of the DLPC350, the controller of the TI DLP LightCrafter 4500, over USB [TI DLPU010, 1.2 and 2]: bytes
// in, bytes out. A message is a header (flags, sequence, length in two bytes, little-endian) and a payload, in HID
// reports of 64 bytes; only the first has a header. The report number 00 in front, which some tools show, is not sent
// on the wire.

namespace scanrig::dlpc350 {

inline constexpr std::size_t kReportBytes = 64;
inline constexpr std::size_t kLargestPayload = 512;
using Report = std::array<std::uint8_t, kReportBytes>;

/// Commands by their numbers CMD2 CMD3.
enum class Command : std::uint16_t {
  hardware_status = 0x1A0A,
  system_status = 0x1A0B,
  main_status = 0x1A0C,
  display_mode = 0x1A1B,
  pattern_source = 0x1A22,
  trigger_mode = 0x1A23,
  start_stop = 0x1A24,
  exposure_period = 0x1A29,
  pattern_config = 0x1A31,
  mailbox_address = 0x1A32,
  mailbox = 0x1A33,
  mailbox_data = 0x1A34,
  trigger_out_1 = 0x1A1D,
  trigger_in_1_delay = 0x1A35,
  validate = 0x1A1A,
  led_enable = 0x1A07,
  led_current = 0x0B01,
  power = 0x0200,
  version = 0x0205,
  enter_programming = 0x3001,
  // Of the bootloader only.
  flash_query = 0x0015,
  flash_data = 0x0025,
  flash_sum = 0x0026,
  flash_erase = 0x0028,
  flash_address = 0x0029,
  flash_size = 0x002C,
  flash_type = 0x002F,
  leave_programming = 0x0030,
};

/// `write`: confirmed by a reply; `send`: a write that is not.
enum class Kind { read, write, send };
std::vector<Report> encode(Command command, Kind kind, std::uint8_t sequence, std::span<const std::uint8_t> data);

/// Puts a reply together, report by report.
class ReplyReader {
 public:
  explicit ReplyReader(std::uint8_t sequence) : sequence_(sequence) {}

  /// True once the reply is whole. Fails with `protocol`: reply to another request, refused by the device, or too long.
  Result<bool> add(const Report& report);
  /// True if the last error was a reply to an earlier request, after which the right one may still come.
  [[nodiscard]] bool was_earlier() const { return earlier_; }
  /// True if the device has refused the command.
  [[nodiscard]] bool was_refused() const { return refused_; }
  [[nodiscard]] const std::vector<std::uint8_t>& payload() const { return payload_; }

 private:
  std::uint8_t sequence_;
  bool earlier_ = false, refused_ = false;
  std::optional<std::size_t> length_;
  std::vector<std::uint8_t> payload_;
};

/// One entry of the pattern table, 24 bits.
struct LutEntry {
  enum class Trigger : std::uint8_t { internal = 0, rising = 1, falling = 2, none = 3 };
  Trigger trigger = Trigger::internal;
  int pattern = 0;        ///< which bit planes of the image, 0 to 23; 24 is all white
  int depth = 1;          ///< bits, 1 to 8
  std::uint8_t leds = 7;  ///< b0 red, b1 green, b2 blue
  bool invert = false;
  bool black_after = false;
  bool swap_buffer = false;  ///< load the image from flash before the pattern
};
std::array<std::uint8_t, 3> encode(const LutEntry& entry);

/// Errors that the device reports, as text; empty if there are none.
std::string hardware_faults(std::uint8_t hardware_status);
std::string system_faults(std::uint8_t system_status);
std::string validation_faults(std::uint8_t validation);

/// The sequencer runs: the light is on.
bool runs(std::uint8_t main_status);
/// The device has no result yet.
bool validating(std::uint8_t validation);

}  // namespace scanrig::dlpc350
