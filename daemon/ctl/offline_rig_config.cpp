#include "daemon/ctl/offline_rig_config.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "daemon/api/socket_file.h"

namespace scanrig::ctl {

Result<config::RigConfig> offline_rig_config(const std::filesystem::path& file) {
  auto rig = config::read_rig_config(file, {}, config::Cameras::or_simulated);
  if (!rig) return rig;
  const auto connected = connect_to_socket(rig->api.socket);
  if (!connected && connected.error().code == ErrorCode::not_found) return rig;
  if (connected) ::close(*connected);
  if (!connected && connected.error().code != ErrorCode::timeout) {
    return pass_on(connected, "cannot tell whether the service uses the rig");
  }
  return fail(ErrorCode::refused,
              "scanrigd holds the rig of {} (it listens at {}); use its maintenance mode, or stop it first: systemctl "
              "stop scanrigd.socket scanrigd.service",
              file.string(), rig->api.socket.string());
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
