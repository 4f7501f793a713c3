#pragma once

#include <string>

#include "drivers/projector/lightcrafter_transport.h"

namespace scanrig::dlpc350 {

using Bytes = std::vector<std::uint8_t>;

/// Requests to one LightCrafter 4500 and their replies, each with a deadline.
/// Threads: one owner.
class Link {
 public:
  Link(OpenTransport open, std::chrono::milliseconds reply_timeout, Clock& clock)
      : open_(std::move(open)), reply_timeout_(reply_timeout), clock_(clock) {}

  /// Fails as OpenTransport.
  Result<void> open();
  void close() { transport_.reset(); }
  [[nodiscard]] bool is_open() const { return transport_ != nullptr; }

  /// Reads with a reply of at least `min_bytes`; writes and waits for the confirmation; sends without one. `data`: of
  /// the request. After a failure the link is closed.
  /// Fail with `timeout`, `io`, `protocol` (refused, or no sense in the reply).
  Result<Bytes> read(Command command, const Bytes& data, std::size_t min_bytes, Deadline deadline);
  Result<void> write(Command command, const Bytes& data, Deadline deadline);
  Result<void> send(Command command, const Bytes& data, Deadline deadline);
  /// True if the last failure was the device's own refusal: it works, and does not have the command.
  [[nodiscard]] bool was_refused() const { return was_refused_; }

 private:
  Result<Bytes> talk(Command command, Kind kind, const Bytes& data, Deadline deadline);
  Result<Bytes> exchange(Command command, Kind kind, const Bytes& data, Deadline deadline);

  const OpenTransport open_;
  const std::chrono::milliseconds reply_timeout_;
  Clock& clock_;
  std::unique_ptr<Transport> transport_;  // null while the device is lost
  std::uint8_t sequence_ = 0;
  bool was_refused_ = false;
};

/// Version of the device's application [DLPU010, 2.1.5].
struct Version {
  int major = 0, minor = 0, patch = 0;
  auto operator<=>(const Version&) const = default;
};
std::string to_string(const Version& version);
Version decode_version(std::span<const std::uint8_t> four_bytes);

/// The oldest firmware whose pattern table and triggers are those of this driver: the guide's revision for 3.0.0.
inline constexpr Version kOldestFirmware{3, 0, 0};

/// The version of a device whose link is open; nothing for one whose bootloader waits for firmware, see
/// load_firmware(). Fails as Link.
Result<std::optional<Version>> read_version(Link& link, Deadline deadline);

}  // namespace scanrig::dlpc350
