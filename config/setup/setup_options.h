#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace scanrig::config::setup {

struct SetupOptions {
  std::filesystem::path out = "/etc/scanrig/rig.toml";
  std::filesystem::path state = "/var/lib/scanrig";  ///< jobs, calibration, tokens
  std::vector<std::string> ports;                    ///< serial ports besides those of this machine
  std::filesystem::path gpio_socket;                 ///< as [gpio] socket; empty: the chips of this machine
  int http_port = 8080;                              ///< of the page, on this machine; 0: none
};

}  // namespace scanrig::config::setup
