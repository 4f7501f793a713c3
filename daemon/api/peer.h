#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/api/role.h"

namespace scanrig {

/// Who is at the other end of a Unix socket, as the kernel saw it when it connected.
struct PeerCredentials {
  uid_t uid = 0;
  std::vector<gid_t> groups;  ///< all of them
};

/// Fails with `io`.
Result<PeerCredentials> peer_credentials(int socket);

/// Which groups make a local user what. Root and the daemon's own user are engineers.
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

/// Without any group named, the caller's own one operates. Fails with `not_found`.
Result<PeerRoles> find_groups(const PeerGroups& groups);

}  // namespace scanrig
