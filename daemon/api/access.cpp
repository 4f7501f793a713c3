#include "daemon/api/access.h"

#include <strings.h>

namespace scanrig {

Access::Access(PeerRoles peers, std::filesystem::path tokens) : peers_(peers), path_(std::move(tokens)) { refresh(); }

void Access::refresh() {
  auto known = std::make_shared<Known>();
  if (!path_.empty()) {
    auto tokens = TokenFile::read(path_);
    if (tokens) {
      known->tokens = std::move(*tokens);
    } else {
      known->problem = tokens.error();
    }
  }
  const std::lock_guard guard(mutex_);
  known_ = std::move(known);
}

std::optional<Error> Access::problem() const { return known()->problem; }

std::optional<Role> Access::role_of(std::optional<Role> peer, std::string_view authorization) const {
  constexpr std::string_view kScheme = "Bearer ";
  if (authorization.empty()) return peer;
  if (authorization.size() < kScheme.size() ||
      ::strncasecmp(authorization.data(), kScheme.data(), kScheme.size()) != 0) {
    return std::nullopt;
  }
  return known()->tokens.role_of(authorization.substr(kScheme.size()));
}

std::shared_ptr<const Access::Known> Access::known() const {
  const std::lock_guard guard(mutex_);
  return known_;
}

}  // namespace scanrig
