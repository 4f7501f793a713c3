#include "daemon/ctl/free_rig.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "daemon/ctl/client.h"

namespace scanrig::ctl {

Result<config::RigConfig> free_rig(const std::filesystem::path& file) {
  auto rig = config::read_rig_config(file, {}, config::Cameras::or_simulated);
  if (rig && ask(rig->api.socket, "GET", "/api/v1/status")) {
    return fail(ErrorCode::refused,
                "scanrigd holds the rig of {} (it answers at {}); use its maintenance mode, or stop it first",
                file.string(), rig->api.socket.string());
  }
  return rig;
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
