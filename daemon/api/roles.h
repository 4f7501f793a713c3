#pragma once

#include <sys/types.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// Rights of a client: each role may do what those before it may.
enum class Role { viewer, operating, engineer };

inline constexpr std::array kRoles{Role::viewer, Role::operating, Role::engineer};

std::string_view to_string(Role role);  ///< "viewer", "operator", "engineer"
std::optional<Role> parse_role(std::string_view name);

/// The process at the other end of a Unix socket, as the kernel recorded it on connection.
struct PeerCredentials {
  uid_t uid = 0;
  std::vector<gid_t> groups;  ///< all of them
};

/// Fails with `io`.
Result<PeerCredentials> peer_credentials(int socket);

/// Who sends a request.
struct Identity {
  std::optional<Role> role{};  ///< nothing: not known
  std::string token{};         ///< name of the token; empty: the kernel's record of the peer, or a code given to it
  std::string cookie{};        ///< by which it was recognised; empty: not by one
};

/// Groups that give a local user each role. Root and the daemon's own user are engineers.
struct PeerRoles {
  std::optional<gid_t> viewer, operating, engineer;

  /// Nothing for a peer in none of the groups.
  [[nodiscard]] std::optional<Role> role_of(const PeerCredentials& peer) const;
};

/// The same by the groups' names.
struct PeerGroups {
  std::optional<std::string> viewer{}, operating{}, engineer{};
  [[nodiscard]] bool any() const { return viewer || operating || engineer; }
};

/// The reverse proxy in front of the API. Requests it forwards count for the address that it names.
struct Proxy {
  std::optional<std::string> address{};  ///< over TCP, as plain_address() writes it
  std::optional<uid_t> user{};           ///< over the Unix socket
};

/// "127.0.0.1", or "unix:USER" for a proxy that connects to the socket as this user. Empty: none.
/// Fails with `invalid_input`, `not_found` (the user).
Result<Proxy> find_proxy(const std::string& name);

/// The address in one spelling, IPv4 as such where it is mapped to IPv6. Nothing where `text` is not an address.
std::optional<std::string> plain_address(std::string_view text);

/// The client that the nearest proxy names in X-Forwarded-For: the last address. Those before it come from the client.
std::optional<std::string> forwarded_address(std::string_view header);

/// Without any group named, the caller's own group operates. Fails with `not_found`.
Result<PeerRoles> find_groups(const PeerGroups& groups);

}  // namespace scanrig
