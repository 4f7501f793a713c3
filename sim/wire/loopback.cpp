#include "sim/wire/loopback.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace scanrig::sim::wire {
namespace {

tl::unexpected<Error> failed(const char* what) { return fail(ErrorCode::io, "{}: {}", what, std::strerror(errno)); }

ifreq with_address(const char* name, const char* address) {
  ifreq request{};
  std::strncpy(request.ifr_name, name, IFNAMSIZ - 1);
  sockaddr_in in{};
  in.sin_family = AF_INET;
  ::inet_pton(AF_INET, address, &in.sin_addr);
  std::memcpy(&request.ifr_addr, &in, sizeof in);
  return request;
}

}  // namespace

Result<void> enter_own_loopback() {
  if (::unshare(CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return failed("a network namespace of its own");
  }
  const int control = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (control < 0) return failed("a socket in the new network");
  ifreq up{};
  std::strncpy(up.ifr_name, "lo", IFNAMSIZ - 1);
  up.ifr_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING;
  ifreq second = with_address("lo:2", "127.0.0.2");
  ifreq mask = with_address("lo:2", "255.0.0.0");
  const bool done = ::ioctl(control, SIOCSIFFLAGS, &up) == 0 && ::ioctl(control, SIOCSIFADDR, &second) == 0 &&
                    ::ioctl(control, SIOCSIFNETMASK, &mask) == 0;
  const int reason = errno;
  ::close(control);
  errno = reason;
  if (!done) return failed("setting up the loopback");
  return {};
}

Result<void> run_in_own_loopback(const std::vector<std::string>& command) {
  if (auto own = enter_own_loopback(); !own) return own;
  std::vector<char*> words;
  for (const auto& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  ::execvp(words[0], words.data());
  return failed(words[0]);
}

}  // namespace scanrig::sim::wire
