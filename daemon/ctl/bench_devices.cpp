#include "daemon/ctl/bench_devices.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/gpio_options.h"
#include "daemon/ctl/client.h"

namespace scanrig::ctl {

Result<config::RigConfig> free_rig(const std::filesystem::path& file) {
  auto rig = config::read_rig_config(file);
  if (rig && ask(rig->api.socket, "GET", "/api/v1/status")) {
    return fail(ErrorCode::refused,
                "scanrigd holds the rig of {} (it answers at {}); use its maintenance mode, or stop it first",
                file.string(), rig->api.socket.string());
  }
  return rig;
}

Result<std::unique_ptr<Turntable>> bench_turntable(const config::RigConfig& rig, Clock& clock) {
  auto table = ModbusTurntable::create(rig.turntable.modbus, clock);
  if (!table) return pass_on(table);
  return std::move(*table);
}

Result<BenchPanel> bench_panel(const config::RigConfig& rig, Clock& clock) {
  BenchPanel bench;
  bench.lines = rig.gpio_socket ? gpio::socket_lines(*rig.gpio_socket, clock) : gpio::chip_lines(clock);
  auto panel = GpioPanel::open(config::gpio_panel_options(rig), *bench.lines, clock);
  if (!panel) return pass_on(panel);
  bench.panel = std::move(*panel);
  return bench;
}

bool agreed(const std::string& question, bool yes) {
  if (yes) return true;
  if (::isatty(STDIN_FILENO) != 1) return false;
  fmt::print(stderr, "{} [y/N] ", question);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "yes";
}

}  // namespace scanrig::ctl
