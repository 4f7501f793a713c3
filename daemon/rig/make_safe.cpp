#include "daemon/rig/make_safe.h"

#include <thread>

#include "daemon/rig/open_devices.h"

namespace scanrig {
namespace {

constexpr auto kLimit = std::chrono::milliseconds(900);
constexpr auto kAgain = std::chrono::milliseconds(20);

template <class Try>
Result<void> until(Clock& clock, Deadline deadline, const Try& attempt) {
  for (;;) {
    auto done = attempt();
    if (done || deadline.left(clock) <= kAgain) return done;
    clock.sleep_for(kAgain);
  }
}

}  // namespace

MadeSafe make_safe(const config::RigConfig& config, Clock& clock, Deadline deadline) {
  const auto open = open_devices(config, clock);
  if (!open) return {pass_on(open), pass_on(open), pass_on(open)};
  MadeSafe made;
  std::thread projector(
      [&] { made.projector = until(clock, deadline, [&] { return open->projector->dark(deadline); }); });
  std::thread panel(
      [&] { made.panel = until(clock, deadline, [&] { return open->panel->show({.red = true}, deadline); }); });
  made.turntable = until(clock, deadline, [&] { return open->turntable->stop(deadline); });
  projector.join();
  panel.join();
  return made;
}

ExitCode make_safe_now(const Result<config::RigConfig>& config, const char* program) {
  if (!config) {
    fmt::print(stderr, "{}: {}\n", program, config.error().message);
    return exit_code(config.error().code);
  }
  RealClock clock;
  const auto made = make_safe(*config, clock, Deadline::after(clock, kLimit));
  for (const auto* one : {&made.turntable, &made.projector, &made.panel}) {
    if (!*one) fmt::print(stderr, "{}: make-safe: {}\n", program, one->error().message);
  }
  if (!made.turntable) return ExitCode::device;
  return made.projector && made.panel ? ExitCode::ok : ExitCode::partly_safe;
}

}  // namespace scanrig
