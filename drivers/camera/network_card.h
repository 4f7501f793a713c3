#pragma once

#include <optional>
#include <string>

namespace scanrig {

/// The card of this machine through which the packets of a network camera come.
struct NetworkCard {
  std::string name;               ///< "enp3s0"
  std::optional<int> speed_mbit;  ///< as negotiated with the other end; nothing: the card does not report it
};

/// The card towards an IPv4 address, its speed from /sys/class/net below `root` [Linux, sysfs-class-net]. Nothing where
/// no route leads there.
std::optional<NetworkCard> network_card_to(const std::string& address, const std::string& root = "");

/// Largest datagram on the way to an IPv4 address, bytes with headers; 0 if unknown.
int path_mtu(const std::string& address);

}  // namespace scanrig
