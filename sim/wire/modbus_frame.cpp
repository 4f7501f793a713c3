#include "sim/wire/modbus_frame.h"

namespace scanrig::sim::wire {
namespace {

constexpr std::size_t kShortRequest = 8;
constexpr std::size_t kWriteHeader = 7;
constexpr std::uint16_t kCoilOn = 0xFF00;

std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void append(Bytes& bytes, std::uint16_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
}

}  // namespace

std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) ? crc >> 1 ^ 0xA001 : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

Bytes with_crc(Bytes bytes) {
  const std::uint16_t crc = modbus_crc(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

bool crc_fits(std::span<const std::uint8_t> frame) {
  if (frame.size() < 4) return false;
  const auto body = frame.first(frame.size() - 2);
  return modbus_crc(body) == (frame[frame.size() - 2] | frame[frame.size() - 1] << 8);
}

std::optional<std::size_t> request_length(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2) return std::nullopt;
  if (bytes[1] != 0x10 && bytes[1] != 0x0F) return kShortRequest;
  if (bytes.size() < kWriteHeader) return std::nullopt;
  return kWriteHeader + bytes[6] + 2;
}

std::optional<ModbusRequest> parse_request(std::span<const std::uint8_t> frame) {
  ModbusRequest request{frame[0], frame[1], word(frame, 2)};
  switch (request.function) {
    case 0x05:
      if (word(frame, 4) != 0 && word(frame, 4) != kCoilOn) return std::nullopt;
      request.bits = {word(frame, 4) == kCoilOn};
      return request;
    case 0x0F:
      if (frame[6] != (word(frame, 4) + 7) / 8) return std::nullopt;
      for (std::size_t i = 0; i < word(frame, 4); ++i) {
        request.bits.push_back((frame[kWriteHeader + i / 8] >> (i % 8) & 1) != 0);
      }
      return request;
    case 0x01:
    case 0x02:
    case 0x03: request.count = word(frame, 4); return request;
    case 0x06: request.values = {word(frame, 4)}; return request;
    case 0x10:
      if (frame[6] != 2 * word(frame, 4)) return std::nullopt;
      for (std::size_t i = 0; i < frame[6]; i += 2) request.values.push_back(word(frame, kWriteHeader + i));
      return request;
    default: return std::nullopt;
  }
}

Bytes read_answer(const ModbusRequest& request, std::span<const std::uint16_t> values) {
  Bytes bytes{request.unit, request.function, static_cast<std::uint8_t>(2 * values.size())};
  for (const std::uint16_t value : values) append(bytes, value);
  return with_crc(std::move(bytes));
}

Bytes bits_answer(const ModbusRequest& request, const std::vector<bool>& bits) {
  Bytes bytes{request.unit, request.function, static_cast<std::uint8_t>((bits.size() + 7) / 8)};
  bytes.resize(bytes.size() + (bits.size() + 7) / 8);
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (bits[i]) bytes[3 + i / 8] = static_cast<std::uint8_t>(bytes[3 + i / 8] | 1 << (i % 8));
  }
  return with_crc(std::move(bytes));
}

Bytes write_answer(const ModbusRequest& request) {
  Bytes bytes{request.unit, request.function};
  append(bytes, request.address);
  if (request.of_bits()) {
    const bool one = request.function == 0x05;
    append(bytes, one ? (request.bits.front() ? kCoilOn : 0) : static_cast<std::uint16_t>(request.bits.size()));
    return with_crc(std::move(bytes));
  }
  append(bytes, request.function == 0x06 ? request.values.front() : static_cast<std::uint16_t>(request.values.size()));
  return with_crc(std::move(bytes));
}

Bytes exception_answer(std::uint8_t unit, std::uint8_t function, std::uint8_t exception) {
  return with_crc({unit, static_cast<std::uint8_t>(function | 0x80), exception});
}

}  // namespace scanrig::sim::wire
