#include <CLI/CLI.hpp>

#include "config/rig_config.h"
#include "daemon/rig/make_safe.h"
#include "daemon/rig/open_devices.h"
#include "daemon/service/service.h"

namespace {

using namespace scanrig;

Result<void> run(const std::filesystem::path& file, SignalStop& stop) {
  Service service("scanrigd", file, config::Cameras::real);
  return service.run(stop, [&](const config::RigConfig& config, const DaemonOptions& options) -> Result<Ended> {
    RealClock clock;
    const auto open = open_devices(config, clock);
    if (!open) return pass_on(open, file.string());
    auto with_way_out = options;
    with_way_out.stop_table_outside = [&file] { return make_safe_in_process("/proc/self/exe", file); };
    return run_daemon(open->devices(), with_way_out, clock, stop.token());
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("scanrigd: the service of a scanning rig. Exit codes: docs/reference/exit-codes.md");
  std::filesystem::path config = "/etc/scanrig/rig.toml";
  bool make_safe = false, beside_daemon = false;
  app.add_option("--config", config, "the rig's configuration")->capture_default_str();
  app.add_flag("--make-safe", make_safe, "stop the table, light off, red lamp; for when the service has ended");
  app.add_flag("--beside-daemon", beside_daemon,
               "with --make-safe: use the turntable's port although a daemon that hangs still has it");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "scanrigd: {}\n", error.what());
    return static_cast<int>(ExitCode::usage);
  }
  if (make_safe)
    return static_cast<int>(make_safe_now(config, "scanrigd", beside_daemon ? Beside::hung_daemon : Beside::nobody));
  SignalStop stop(SignalStop::Hangup::is_told);
  const auto done = run(config, stop);
  if (done) return static_cast<int>(ExitCode::ok);
  fmt::print(stderr, "scanrigd: {}\n", done.error().message);
  return static_cast<int>(exit_code(done.error().code));
}
