#include "drivers/projector/lightcrafter_packets.h"

#include <algorithm>

namespace scanrig::dlpc350 {
namespace {

constexpr std::uint8_t kRead = 0x80, kWantsReply = 0x40, kRefused = 0x20;
constexpr std::size_t kHeaderBytes = 4;

struct Bit {
  int bit;
  bool bad_when;  // value that means a fault
  const char* words;
};

std::string in_words(std::uint8_t status, std::span<const Bit> bits) {
  std::string words;
  for (const Bit& bit : bits) {
    if (((status >> bit.bit & 1) != 0) != bit.bad_when) continue;
    if (!words.empty()) words += ", ";
    words += bit.words;
  }
  return words;
}

}  // namespace

std::vector<Report> encode(Command command, Kind kind, std::uint8_t sequence, std::span<const std::uint8_t> data) {
  const auto code = static_cast<std::uint16_t>(command);
  const std::size_t length = 2 + data.size();
  const std::uint8_t flags = kind == Kind::read ? kRead | kWantsReply : kind == Kind::write ? kWantsReply : 0;
  std::vector<std::uint8_t> bytes{flags,
                                  sequence,
                                  static_cast<std::uint8_t>(length),
                                  static_cast<std::uint8_t>(length >> 8),
                                  static_cast<std::uint8_t>(code),
                                  static_cast<std::uint8_t>(code >> 8)};
  bytes.insert(bytes.end(), data.begin(), data.end());
  std::vector<Report> reports((bytes.size() + kReportBytes - 1) / kReportBytes, Report{});
  for (std::size_t i = 0; i < bytes.size(); ++i) reports[i / kReportBytes][i % kReportBytes] = bytes[i];
  return reports;
}

Result<bool> ReplyReader::add(const Report& report) {
  earlier_ = false;
  std::size_t begin = 0;
  if (!length_) {
    if (report[1] != sequence_) {
      earlier_ = true;
      return fail(ErrorCode::protocol, "the reply is to request {}, not to {}", report[1], sequence_);
    }
    refused_ = (report[0] & kRefused) != 0;
    if (refused_) return fail(ErrorCode::protocol, "the device refuses the command");
    const std::size_t length = report[2] | static_cast<std::size_t>(report[3]) << 8;
    if (length > kLargestPayload) return fail(ErrorCode::protocol, "a reply of {} bytes cannot be", length);
    length_ = length;
    begin = kHeaderBytes;
  }
  const std::size_t missing = *length_ - payload_.size();
  const std::size_t count = std::min(missing, kReportBytes - begin);
  const auto first = report.begin() + static_cast<std::ptrdiff_t>(begin);
  payload_.insert(payload_.end(), first, first + static_cast<std::ptrdiff_t>(count));
  return payload_.size() == *length_;
}

std::array<std::uint8_t, 3> encode(const LutEntry& entry) {
  const auto flag = [](bool set, int bit) { return set ? std::uint32_t{1} << bit : 0u; };
  const std::uint32_t word =
      static_cast<std::uint32_t>(entry.trigger) | static_cast<std::uint32_t>(entry.pattern) << 2 |
      static_cast<std::uint32_t>(entry.depth) << 8 | static_cast<std::uint32_t>(entry.leds) << 12 |
      flag(entry.invert, 16) | flag(entry.black_after, 17) | flag(entry.swap_buffer, 18);
  return {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8), static_cast<std::uint8_t>(word >> 16)};
}

std::string hardware_faults(std::uint8_t status) {
  constexpr std::array kBits{Bit{0, false, "its start-up failed"}, Bit{2, true, "the DMD's reset controller fails"},
                             Bit{3, true, "a buffer was swapped by force"}, Bit{6, true, "the sequencer gave up"},
                             Bit{7, true, "the sequencer found an error"}};
  return in_words(status, kBits);
}

std::string system_faults(std::uint8_t status) {
  constexpr std::array kBits{Bit{0, false, "its memory test failed"}};
  return in_words(status, kBits);
}

std::string validation_faults(std::uint8_t validation) {
  // Bits 2 and 3 are remarks, not faults: they concern sequences of several patterns.
  constexpr std::array kBits{Bit{0, true, "exposure or period out of range"}, Bit{1, true, "no such pattern"},
                             Bit{4, true, "period and exposure must be equal or 230 us apart"}};
  return in_words(validation, kBits);
}

bool runs(std::uint8_t main_status) { return main_status & 0x02; }
bool validating(std::uint8_t validation) { return validation & 0x80; }

}  // namespace scanrig::dlpc350
