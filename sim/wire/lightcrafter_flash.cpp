#include "sim/wire/lightcrafter_flash.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace scanrig::sim::wire {
namespace {

constexpr std::uint32_t kMapped = 0xF9000000, kSignature = 0x01234567;
constexpr std::size_t kTable = 0x20000, kAppEntry = kTable + 16, kConfigEntry = kTable + 112;
constexpr std::size_t kApp = 0x30000, kAppBytes = 0x1000, kConfig = 0x32000;

std::uint32_t read_le(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4 && at + i < bytes.size(); ++i) word |= std::uint32_t{bytes[at + i]} << (8 * i);
  return word;
}

void write_le(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t word) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(word >> (8 * i));
}

}  // namespace

LightCrafterFlash::LightCrafterFlash(Clock& clock) : clock_(clock), bytes_(kBytes, 0xFF) {
  constexpr std::uint32_t kFactory = 0x04010000;  // 4.1.0
  install(make_file(kFactory, 3 * kSectorBytes));
}

std::vector<std::uint8_t> LightCrafterFlash::make_file(std::uint32_t version, std::size_t bytes) {
  std::vector<std::uint8_t> file(bytes);
  std::uint32_t random = version | 1u;
  for (std::uint8_t& byte : file) {
    random = random * 1664525u + 1013904223u;
    byte = static_cast<std::uint8_t>(random >> 24);
  }
  write_le(file, kTable, kSignature);
  write_le(file, kAppEntry, kMapped + kApp);
  write_le(file, kAppEntry + 4, kAppBytes);
  write_le(file, kConfigEntry, kMapped + kConfig);
  write_le(file, kConfig, version);
  write_le(file, bytes - 4, 0x600D600D);  // the last image's end
  return file;
}

void LightCrafterFlash::install(std::span<const std::uint8_t> file) {
  std::ranges::fill(bytes_, 0xFF);
  std::ranges::copy(file, bytes_.begin());
}

/// A real one checks less; this one does not start while any part of the image is erased or lost.
std::optional<std::uint32_t> LightCrafterFlash::version() const {
  if (read_le(bytes_, kTable) != kSignature) return std::nullopt;
  const auto written = std::find_if(bytes_.rbegin(), bytes_.rend(), [](std::uint8_t byte) { return byte != 0xFF; });
  const auto end = static_cast<std::size_t>(written.base() - bytes_.begin());
  if (end < 4 || read_le(bytes_, end - 4) != 0x600D600D) return std::nullopt;
  return read_le(bytes_, read_le(bytes_, kConfigEntry) - kMapped);
}

bool LightCrafterFlash::write(std::uint16_t command, const std::vector<std::uint8_t>& data) {
  constexpr auto kEraseTime = std::chrono::milliseconds(20);
  if (is_busy()) return false;
  switch (command) {
    case 0x0029: address_ = read_le(data, 0); return data.size() == 4 && address_ < kBytes;
    case 0x002C: size_ = read_le(data, 0); return data.size() == 4 && size_ <= kBytes;
    case 0x002F: return data.size() == 1 && data[0] == 0;
    case 0x0028: {
      const std::size_t begin = address_ / kSectorBytes * kSectorBytes;
      std::fill_n(bytes_.begin() + static_cast<std::ptrdiff_t>(begin), kSectorBytes, std::uint8_t{0xFF});
      busy_until_ = clock_.now() + kEraseTime;
      return true;
    }
    case 0x0025: return write_data(data);
    case 0x0026: {
      const auto first = bytes_.begin() + static_cast<std::ptrdiff_t>(address_);
      const auto count = std::min(size_, kBytes - address_);
      sum_ = std::accumulate(first, first + static_cast<std::ptrdiff_t>(count), std::uint32_t{0});
      return true;
    }
    default: return false;
  }
}

bool LightCrafterFlash::write_data(const std::vector<std::uint8_t>& data) {
  constexpr std::size_t kLargest = 504;
  if (data.empty() || data.size() > kLargest || data.size() > size_ || address_ + data.size() > kBytes) return false;
  for (const std::uint8_t byte : data) {
    std::uint8_t& cell = bytes_[address_++];
    cell = static_cast<std::uint8_t>(cell & byte);
  }
  if (std::exchange(damages_, false)) bytes_[address_ - 1] = static_cast<std::uint8_t>(~data.back());
  size_ -= data.size();
  return true;
}

std::vector<std::uint8_t> LightCrafterFlash::read(std::uint16_t command, const std::vector<std::uint8_t>& data) const {
  if (command != 0x0015 || data.size() != 1) return {};
  std::vector<std::uint8_t> reply(16);
  reply[0] = is_busy() ? 0x08 : 0x00;
  if (data[0] == 0x0C) write_le(reply, 6, maker_);
  if (data[0] == 0x0D) write_le(reply, 6, 0x227E);
  if (data[0] == 0x00) write_le(reply, 6, sum_);
  return reply;
}

}  // namespace scanrig::sim::wire
