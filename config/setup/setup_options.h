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
  /// The rig.toml that is there: what it says of other things than devices stays as it is. Empty: there is none.
  std::filesystem::path present;
  std::filesystem::path
      images;  ///< a folder for what the cameras see, for the person who has to choose; empty: none is taken
};

}  // namespace scanrig::config::setup
