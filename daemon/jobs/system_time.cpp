#include "daemon/jobs/system_time.h"

#include <sys/timex.h>

#include <optional>

#include "daemon/jobs/child_process.h"

namespace scanrig {
namespace {

constexpr const char* kTimedatectl = "/usr/bin/timedatectl";
constexpr auto kLimit = std::chrono::seconds(5);

/// The kernel's estimate of the error starts at 16 s, and returns there when the clock is set by hand. It is kept
/// smaller by timesyncd, chrony and ntpd alike [ntp_synced() of systemd-timedated]. STA_UNSYNC is no
/// criterion: chrony sets it to keep the kernel away from the clock chip. Nothing where the kernel refuses.
std::optional<bool> kernel_synchronized() {
  constexpr long kUnsynchronizedUs = 16'000'000;
  timex state{};  // no modes: reads only
  if (::adjtimex(&state) < 0) return std::nullopt;
  return state.maxerror < kUnsynchronizedUs;
}

/// The service's sandbox has no adjtimex (ProtectClock=yes); systemd-timedated, outside of it, reads the same.
bool timedated_synchronized(const std::stop_token& stop) {
  bool synchronized = false;
  const auto ended = run_child({.words = {kTimedatectl, "show", "--property=NTPSynchronized", "--value"},
                                .limit = kLimit,
                                .on_line = [&](std::string_view line) { synchronized = line == "yes"; }},
                               stop);
  return ended && ended->code == 0 && synchronized;
}

class KernelTime final : public SystemTime {
 public:
  [[nodiscard]] TimeReading read(const std::stop_token& stop) const override {
    const auto known = kernel_synchronized();
    const bool synchronized = known ? *known : timedated_synchronized(stop);
    return {.wall = std::chrono::system_clock::now(),
            .is_synchronized = synchronized,
            .running =
                std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now().time_since_epoch())};
  }
};

}  // namespace

std::shared_ptr<const SystemTime> system_time() { return std::make_shared<KernelTime>(); }

}  // namespace scanrig
