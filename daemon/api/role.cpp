#include "daemon/api/role.h"

namespace scanrig {

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

}  // namespace scanrig
