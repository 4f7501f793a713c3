#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace scanrig::sim::wire {

using Bytes = std::vector<std::uint8_t>;

/// Exception codes [Modbus application protocol V1.1b3, section 7].
inline constexpr std::uint8_t kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3;

/// CRC-16/MODBUS: polynomial 0xA001 reflected, start 0xFFFF [Modbus over serial line V1.02, appendix B].
std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes);
/// The bytes with their checksum, low byte first.
Bytes with_crc(Bytes bytes);
bool crc_fits(std::span<const std::uint8_t> frame);

/// A request of one of the functions of drives and I/O modules. Registers: 03 read, 06 write one, 16 write several.
/// Bits: 01 read coils, 02 read inputs, 05 write one coil, 15 write several.
struct ModbusRequest {
  std::uint8_t unit = 0;
  std::uint8_t function = 0;
  std::uint16_t address = 0;
  std::uint16_t count = 0;              ///< registers or bits to read
  std::vector<std::uint16_t> values{};  ///< to write
  std::vector<bool> bits{};             ///< to write

  [[nodiscard]] bool of_bits() const {
    return function == 0x01 || function == 0x02 || function == 0x05 || function == 0x0F;
  }
};

/// Length of the frame that starts with these bytes; nothing: more bytes are needed.
std::optional<std::size_t> request_length(std::span<const std::uint8_t> bytes);

/// Reads a frame of the right length and checksum; nothing for an unknown function or inconsistent lengths.
std::optional<ModbusRequest> parse_request(std::span<const std::uint8_t> frame);

Bytes read_answer(const ModbusRequest& request, std::span<const std::uint16_t> values);
Bytes bits_answer(const ModbusRequest& request, const std::vector<bool>& bits);
Bytes write_answer(const ModbusRequest& request);
Bytes exception_answer(std::uint8_t unit, std::uint8_t function, std::uint8_t exception);

}  // namespace scanrig::sim::wire
