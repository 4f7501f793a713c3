#include "daemon/service/passed_sockets.h"

#include <sys/socket.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace scanrig {

PassedSockets take_passed_sockets() {
  PassedSockets passed;
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    const int fd = SD_LISTEN_FDS_START + i;
    const bool ours = names && std::string_view(names[i]) == "api";
    if (ours && !passed.local && ::sd_is_socket(fd, AF_UNIX, SOCK_STREAM, 1) > 0) {
      passed.local = fd;
    } else if (ours && !passed.tcp && ::sd_is_socket_inet(fd, AF_UNSPEC, SOCK_STREAM, 1, 0) > 0) {
      passed.tcp = fd;
    } else {
      ::close(fd);
    }
  }
  for (int i = 0; i < count && names; ++i) ::free(names[i]);
  ::free(names);
  return passed;
}

}  // namespace scanrig
