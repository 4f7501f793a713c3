#include "drivers/projector/lightcrafter_flash.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace scanrig::dlpc350 {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// The flash of the module: equal sectors, of which the first has the bootloader. Its content is mapped at kFlashBase.
constexpr std::size_t kSectorBytes = 0x20000, kLargestFile = 30 * 1024 * 1024;
constexpr std::uint32_t kFlashBase = 0xF9000000;
// The table at the begin of the second sector: its signature, and where the version is.
constexpr std::size_t kTable = kSectorBytes, kConfigAddress = kTable + 112, kTableBytes = 320;
constexpr std::uint32_t kSignature = 0x01234567;
constexpr std::uint8_t kQuerySum = 0x00, kQueryMaker = 0x0C, kQueryDevice = 0x0D;
constexpr std::uint32_t kMaker = 0x0020, kDevice = 0x227E;
constexpr std::uint8_t kFlashBusy = 0x08;
constexpr std::size_t kPieceBytes = 504;  // 512 with the header and the command; the bootloader takes 2 less
constexpr milliseconds kReplyTimeout{2000}, kPoll{5};
constexpr seconds kRestartTimeout{30}, kFlashTimeout{20};

std::uint32_t little_endian_word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] | std::uint32_t{bytes[at + 1]} << 8 | std::uint32_t{bytes[at + 2]} << 16 |
         std::uint32_t{bytes[at + 3]} << 24;
}

Bytes in_bytes(std::size_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)};
}

class Loader {
 public:
  Loader(std::span<const std::uint8_t> file, const OpenTransport& open, const OnFlashProgress& on_progress,
         Clock& clock, Deadline deadline)
      : file_(file), on_progress_(on_progress), clock_(clock), deadline_(deadline), link_(open, kReplyTimeout, clock) {}

  Result<Version> load() {
    if (auto opened = link_.open(); !opened) return pass_on(opened);
    if (auto ready = enter_bootloader(); !ready) return pass_on(ready);
    if (auto known = check_flash(); !known) return pass_on(known);
    if (auto written = rewrite(); !written) {
      return pass_on(written, "the flash is not whole, run scanrig projector load again");
    }
    if (auto left = link_.send(Command::leave_programming, {2}, deadline_); !left) return pass_on(left);
    return wait_for_restart();
  }

 private:
  Result<void> enter_bootloader() {
    const auto version = read_version(link_, deadline_);
    if (!version) return pass_on(version);
    if (!*version) return {};  // of an earlier load
    if (auto told = link_.send(Command::enter_programming, {1}, deadline_); !told) return told;
    const Deadline limit = deadline_.at_most(clock_, kRestartTimeout);
    for (;;) {
      if (const auto now = reconnect(); now && !*now) return {};
      if (limit.expired(clock_)) {
        return fail(ErrorCode::timeout, "its bootloader does not start; switch it off and on");
      }
    }
  }

  /// The device leaves USB and comes back: its version then, see read_version().
  Result<std::optional<Version>> reconnect() {
    constexpr milliseconds kPause{200};
    link_.close();
    clock_.sleep_for(kPause);
    if (auto opened = link_.open(); !opened) return pass_on(opened);
    return read_version(link_, deadline_);
  }

  Result<Version> wait_for_restart() {
    const Deadline limit = deadline_.at_most(clock_, kRestartTimeout);
    for (;;) {
      const auto version = reconnect();
      if (version && *version) return **version;
      if (limit.expired(clock_)) {
        return fail(ErrorCode::timeout, "the firmware is written and does not start; switch it off and on");
      }
    }
  }

  Result<std::uint32_t> query(std::uint8_t what) {
    constexpr std::size_t kAnswer = 6, kAnswerBytes = kAnswer + 4;
    const auto reply = link_.read(Command::flash_query, {what}, kAnswerBytes, deadline_);
    if (!reply) return pass_on(reply);
    return little_endian_word(*reply, kAnswer);
  }

  Result<void> check_flash() {
    const auto maker = query(kQueryMaker);
    if (!maker) return pass_on(maker);
    const auto device = query(kQueryDevice);
    if (!device) return pass_on(device);
    if ((*maker & 0xFFFF) != kMaker || (*device & 0xFFFF) != kDevice) {
      return fail(ErrorCode::unsupported, "its flash is {:04X}:{:04X}, not that of the module; use TI's software",
                  *maker & 0xFFFF, *device & 0xFFFF);
    }
    return link_.write(Command::flash_type, {0}, deadline_);
  }

  Result<void> rewrite() {
    for (std::size_t at = kSectorBytes; at < file_.size(); at += kSectorBytes) {
      if (auto erased = erase(at); !erased) return erased;
      report("erase", at + kSectorBytes);
    }
    if (auto written = write_pieces(); !written) return written;
    for (std::size_t at = kSectorBytes; at < file_.size(); at += kSectorBytes) {
      if (auto same = compare(at); !same) return same;
      report("check", at + kSectorBytes);
    }
    return {};
  }

  Result<void> erase(std::size_t at) {
    if (auto set = link_.write(Command::flash_address, in_bytes(at), deadline_); !set) return set;
    if (auto told = link_.write(Command::flash_erase, {}, deadline_); !told) return told;
    return wait_until_ready();
  }

  Result<void> write_pieces() {
    const std::size_t size = file_.size() - kSectorBytes;
    if (auto set = link_.write(Command::flash_address, in_bytes(kSectorBytes), deadline_); !set) return set;
    if (auto set = link_.write(Command::flash_size, in_bytes(size), deadline_); !set) return set;
    for (std::size_t at = kSectorBytes; at < file_.size(); at += kPieceBytes) {
      const auto piece = file_.subspan(at, std::min(kPieceBytes, file_.size() - at));
      if (auto sent = link_.send(Command::flash_data, {piece.begin(), piece.end()}, deadline_); !sent) return sent;
      report("write", at + piece.size());
    }
    return wait_until_ready();
  }

  /// Compares the sum of a sector's bytes.
  Result<void> compare(std::size_t at) {
    const auto sector = file_.subspan(at, std::min(kSectorBytes, file_.size() - at));
    if (auto set = link_.write(Command::flash_address, in_bytes(at), deadline_); !set) return set;
    if (auto set = link_.write(Command::flash_size, in_bytes(sector.size()), deadline_); !set) return set;
    if (auto told = link_.send(Command::flash_sum, {}, deadline_); !told) return told;
    if (auto ready = wait_until_ready(); !ready) return ready;
    const auto sum = query(kQuerySum);
    if (!sum) return pass_on(sum);
    if (*sum == std::accumulate(sector.begin(), sector.end(), std::uint32_t{0})) return {};
    return fail(ErrorCode::protocol, "the flash differs from the file in the sector at 0x{:06X}", at);
  }

  Result<void> wait_until_ready() {
    const Deadline limit = deadline_.at_most(clock_, kFlashTimeout);
    for (;;) {
      const auto status = link_.read(Command::flash_query, {kQuerySum}, 1, limit);
      if (!status) return pass_on(status);
      if ((status->front() & kFlashBusy) == 0) return {};
      if (limit.expired(clock_)) return fail(ErrorCode::timeout, "its flash stays busy");
      clock_.sleep_for(kPoll);
    }
  }

  void report(std::string_view step, std::size_t done) const {
    const auto all = static_cast<double>(file_.size() - kSectorBytes);
    on_progress_(step, std::min(1.0, static_cast<double>(done - kSectorBytes) / all));
  }

  const std::span<const std::uint8_t> file_;
  const OnFlashProgress& on_progress_;
  Clock& clock_;
  const Deadline deadline_;
  Link link_;
};

}  // namespace

Result<Version> check_firmware_file(std::span<const std::uint8_t> file) {
  const auto refused = [](std::string_view why) {
    return fail(ErrorCode::invalid_input, "no firmware of a LightCrafter 4500: {}; make it with TI's control software",
                why);
  };
  if (file.size() < kTable + kTableBytes) return refused("it is too short");
  if (file.size() > kLargestFile) return refused("it is too long");
  if (little_endian_word(file, kTable) != kSignature) return refused("it has no flash table");
  const std::size_t config = little_endian_word(file, kConfigAddress) - kFlashBase;
  if (config < kTable || config + 4 > file.size()) return refused("it ends before its version");
  const Version version = decode_version(file.subspan(config, 4));
  if (version >= kOldestFirmware) return version;
  return fail(ErrorCode::unsupported, "firmware {} is older than {}", to_string(version), to_string(kOldestFirmware));
}

Result<Version> load_firmware(std::span<const std::uint8_t> file, const OpenTransport& open,
                              const OnFlashProgress& on_progress, Clock& clock, Deadline deadline) {
  if (const auto checked = check_firmware_file(file); !checked) return pass_on(checked, "projector");
  auto loaded = Loader(file, open, on_progress, clock, deadline).load();
  if (!loaded) return pass_on(loaded, "projector");
  return loaded;
}

}  // namespace scanrig::dlpc350
