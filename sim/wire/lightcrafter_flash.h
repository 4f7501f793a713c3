#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/clock.h"

namespace scanrig::sim::wire {

/// Flash and bootloader of a LightCrafter 4500. Erasing sets a sector's bits and takes time; writing can only clear
/// bits. The application starts only from a whole image: an interrupted load leaves the bootloader.
/// Threads: one at a time.
class LightCrafterFlash {
 public:
  static constexpr std::size_t kSectorBytes = 0x20000, kBytes = 16 * kSectorBytes;

  explicit LightCrafterFlash(Clock& clock);

  /// A firmware file: bootloader, table, application with this version, images.
  static std::vector<std::uint8_t> make_file(std::uint32_t version, std::size_t bytes);
  void install(std::span<const std::uint8_t> file);
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

  /// Version of the application, as its version command reports it; nothing if it is not whole.
  [[nodiscard]] std::optional<std::uint32_t> version() const;

  /// Commands of the bootloader. False: refused.
  bool write(std::uint16_t command, const std::vector<std::uint8_t>& data);
  /// Reply; empty: refused.
  std::vector<std::uint8_t> read(std::uint16_t command, const std::vector<std::uint8_t>& data) const;

  void set_maker(std::uint16_t maker) { maker_ = maker; }
  void damage_next_data() { damages_ = true; }  ///< a bit is lost on the way

 private:
  [[nodiscard]] bool is_busy() const { return clock_.now() < busy_until_; }
  bool write_data(const std::vector<std::uint8_t>& data);

  Clock& clock_;
  std::vector<std::uint8_t> bytes_;
  std::size_t address_ = 0, size_ = 0;
  std::uint32_t sum_ = 0;
  std::uint16_t maker_ = 0x0020;
  bool damages_ = false;
  Clock::TimePoint busy_until_{};
};

}  // namespace scanrig::sim::wire
