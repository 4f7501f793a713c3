#include "drivers/projector/lightcrafter_link.h"

#include <fmt/format.h>

namespace scanrig::dlpc350 {
namespace {

constexpr std::size_t kVersionBytes = 4;
constexpr std::uint8_t kMakerOfFlash = 0x0C;  // what of the flash is read

}  // namespace

Result<void> Link::open() {
  auto opened = open_();
  if (!opened) return pass_on(opened);
  transport_ = std::move(*opened);
  return {};
}

Result<Bytes> Link::read(Command command, const Bytes& data, std::size_t min_bytes, Deadline deadline) {
  auto reply = talk(command, Kind::read, data, deadline);
  if (!reply || reply->size() >= min_bytes) return reply;
  transport_.reset();
  return fail(ErrorCode::protocol, "command {:04X}: a reply of {} bytes instead of {}",
              static_cast<std::uint16_t>(command), reply->size(), min_bytes);
}

Result<void> Link::write(Command command, const Bytes& data, Deadline deadline) {
  const auto reply = talk(command, Kind::write, data, deadline);
  if (!reply) return pass_on(reply);
  return {};
}

Result<void> Link::send(Command command, const Bytes& data, Deadline deadline) {
  const auto sent = talk(command, Kind::send, data, deadline);
  if (!sent) return pass_on(sent);
  return {};
}

/// A device that is lost or sends nonsense is connected again by the next call.
Result<Bytes> Link::talk(Command command, Kind kind, const Bytes& data, Deadline deadline) {
  was_refused_ = false;
  if (!transport_) return fail(ErrorCode::io, "the LightCrafter is not connected");
  auto reply = exchange(command, kind, data, deadline.at_most(clock_, reply_timeout_));
  if (reply) return reply;
  transport_.reset();
  return pass_on(reply, fmt::format("command {:04X}", static_cast<std::uint16_t>(command)));
}

Result<Bytes> Link::exchange(Command command, Kind kind, const Bytes& data, Deadline deadline) {
  const std::uint8_t sequence = ++sequence_;
  for (const auto& report : encode(command, kind, sequence, data)) {
    if (auto sent = transport_->send(report, deadline); !sent) return pass_on(sent);
  }
  if (kind == Kind::send) return Bytes{};
  ReplyReader reader(sequence);
  for (;;) {
    const auto report = transport_->receive(deadline);
    if (!report) return pass_on(report);
    const auto whole = reader.add(*report);
    if (!whole && reader.was_earlier() && !deadline.expired(clock_)) continue;  // reply to a request given up before
    was_refused_ = reader.was_refused();
    if (!whole) return pass_on(whole);
    if (*whole) return reader.payload();
  }
}

std::string to_string(const Version& version) {
  return fmt::format("{}.{}.{}", version.major, version.minor, version.patch);
}

Version decode_version(std::span<const std::uint8_t> bytes) { return {bytes[3], bytes[2], bytes[0] + 256 * bytes[1]}; }

Result<std::optional<Version>> read_version(Link& link, Deadline deadline) {
  const auto version = link.read(Command::version, {}, kVersionBytes, deadline);
  if (version) return std::optional(decode_version(*version));
  if (!link.was_refused()) return pass_on(version);
  // Refused: the bootloader, which replies to this instead, or a device that has neither.
  if (auto opened = link.open(); !opened) return pass_on(opened);
  const auto flash = link.read(Command::flash_query, {kMakerOfFlash}, 1, deadline);
  if (!flash) return pass_on(version);
  return std::optional<Version>{};
}

}  // namespace scanrig::dlpc350
