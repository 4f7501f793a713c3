#include "daemon/api/roles.h"

#include <arpa/inet.h>
#include <grp.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace scanrig {
namespace {

Result<gid_t> group_id(const std::string& name) {
  group entry{};
  group* found = nullptr;
  std::vector<char> room(64 * 1024);
  const int error = ::getgrnam_r(name.c_str(), &entry, room.data(), room.size(), &found);
  if (error != 0 || found == nullptr) {
    return fail(ErrorCode::not_found, "there is no group \"{}\" on this machine: add it, or name another in [api]",
                name);
  }
  return entry.gr_gid;
}

}  // namespace

std::string_view to_string(Role role) {
  switch (role) {
    case Role::viewer: return "viewer";
    case Role::operating: return "operator";
    case Role::engineer: break;
  }
  return "engineer";
}

std::optional<Role> parse_role(std::string_view name) {
  for (const Role role : kRoles) {
    if (name == to_string(role)) return role;
  }
  return std::nullopt;
}

Result<PeerCredentials> peer_credentials(int socket) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) {
    return fail(ErrorCode::io, "the kernel does not tell who connected: {}", std::strerror(errno));
  }
  PeerCredentials peer{credentials.uid, {credentials.gid}};
  std::vector<gid_t> groups(64);
  socklen_t bytes = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  int got = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes);
  if (got != 0 && errno == ERANGE) {
    groups.resize(bytes / sizeof(gid_t));
    got = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes);
  }
  if (got == 0) peer.groups.insert(peer.groups.end(), groups.begin(), groups.begin() + bytes / sizeof(gid_t));
  return peer;
}

std::optional<Role> PeerRoles::role_of(const PeerCredentials& peer) const {
  if (peer.uid == 0 || peer.uid == ::geteuid()) return Role::engineer;
  const auto in = [&](const std::optional<gid_t>& group) {
    return group && std::ranges::find(peer.groups, *group) != peer.groups.end();
  };
  if (in(engineer)) return Role::engineer;
  if (in(operating)) return Role::operating;
  if (in(viewer)) return Role::viewer;
  return std::nullopt;
}

Result<PeerRoles> find_groups(const PeerGroups& groups) {
  PeerRoles roles;
  if (!groups.any()) roles.operating = ::getegid();
  for (const auto& [name, id] :
       {std::pair(&groups.viewer, &roles.viewer), std::pair(&groups.operating, &roles.operating),
        std::pair(&groups.engineer, &roles.engineer)}) {
    if (!*name) continue;
    const auto found = group_id(**name);
    if (!found) return pass_on(found);
    *id = *found;
  }
  return roles;
}

Result<Proxy> find_proxy(const std::string& name) {
  constexpr std::string_view kUnix = "unix:";
  if (name.empty()) return Proxy{};
  if (!name.starts_with(kUnix)) {
    const auto address = plain_address(name);
    if (address) return Proxy{.address = address};
    return fail(ErrorCode::invalid_input, "[api] proxy \"{}\": name an IP address or \"unix:USER\"", name);
  }
  passwd entry{};
  passwd* found = nullptr;
  std::vector<char> room(64 * 1024);
  const auto user = name.substr(kUnix.size());
  const int error = ::getpwnam_r(user.c_str(), &entry, room.data(), room.size(), &found);
  if (error == 0 && found != nullptr) return Proxy{.user = entry.pw_uid};
  return fail(ErrorCode::not_found, "[api] proxy: no user \"{}\" on this machine; add it, or name another", user);
}

std::optional<std::string> plain_address(std::string_view text) {
  const std::string address(text);
  char plain[INET6_ADDRSTRLEN];
  in_addr v4{};
  if (::inet_pton(AF_INET, address.c_str(), &v4) == 1) return ::inet_ntop(AF_INET, &v4, plain, sizeof plain);
  in6_addr v6{};
  if (::inet_pton(AF_INET6, address.c_str(), &v6) != 1) return std::nullopt;
  if (!IN6_IS_ADDR_V4MAPPED(&v6)) return ::inet_ntop(AF_INET6, &v6, plain, sizeof plain);
  std::memcpy(&v4, &v6.s6_addr[12], sizeof v4);
  return ::inet_ntop(AF_INET, &v4, plain, sizeof plain);
}

std::optional<std::string> forwarded_address(std::string_view header) {
  const auto comma = header.rfind(',');
  auto last = header.substr(comma == std::string_view::npos ? 0 : comma + 1);
  constexpr std::string_view kBlank = " \t";
  const auto begin = last.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return std::nullopt;
  last = last.substr(begin, last.find_last_not_of(kBlank) + 1 - begin);
  return plain_address(last);
}

}  // namespace scanrig
