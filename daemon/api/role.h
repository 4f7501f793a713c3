#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace scanrig {

/// Rights of a client: each role may do what those before it may.
enum class Role { viewer, operating, engineer };

inline constexpr std::array kRoles{Role::viewer, Role::operating, Role::engineer};

std::string_view to_string(Role role);  ///< "viewer", "operator", "engineer"
std::optional<Role> parse_role(std::string_view name);

}  // namespace scanrig
