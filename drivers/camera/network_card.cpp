#include "drivers/camera/network_card.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

namespace scanrig {
namespace {

constexpr std::uint16_t kControlPort = 3956;  // of GigE Vision cameras; no packet is sent

/// A socket whose packets would go to `address`, or -1.
int socket_towards(const std::string& address) {
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  peer.sin_port = htons(kControlPort);
  if (::inet_pton(AF_INET, address.c_str(), &peer.sin_addr) != 1) return -1;
  const int probe = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (::connect(probe, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) == 0) return probe;
  ::close(probe);
  return -1;
}

/// Name of the card that has this address of our own; empty if there is none.
std::string card_with(in_addr own) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return {};
  std::string name;
  for (const ifaddrs* one = all; one && name.empty(); one = one->ifa_next) {
    if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
    if (reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr == own.s_addr) name = one->ifa_name;
  }
  ::freeifaddrs(all);
  return name.substr(0, name.find(':'));  // "lo:2" is a second address of lo
}

}  // namespace

std::optional<NetworkCard> network_card_to(const std::string& address, const std::string& root) {
  const int probe = socket_towards(address);
  if (probe < 0) return std::nullopt;
  sockaddr_in own{};
  socklen_t size = sizeof own;
  const bool is_known = ::getsockname(probe, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  ::close(probe);
  NetworkCard card{is_known ? card_with(own.sin_addr) : "", std::nullopt};
  if (card.name.empty()) return std::nullopt;
  int speed = 0;  // -1: no link; reading fails where there is no cable at all, as on lo
  if (std::ifstream(root + "/sys/class/net/" + card.name + "/speed") >> speed && speed > 0) card.speed_mbit = speed;
  return card;
}

int path_mtu(const std::string& address) {
  const int probe = socket_towards(address);
  if (probe < 0) return 0;
  int mtu = 0;
  socklen_t size = sizeof mtu;
  if (::getsockopt(probe, IPPROTO_IP, IP_MTU, &mtu, &size) != 0) mtu = 0;
  ::close(probe);
  return mtu;
}

}  // namespace scanrig
