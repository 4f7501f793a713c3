#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>

#include "daemon/api/peer.h"
#include "daemon/api/tokens.h"

namespace scanrig {

/// Decides what a client may do. Threads: any.
class Access {
 public:
  /// `tokens`: the file; empty: no tokens.
  Access(PeerRoles peers, std::filesystem::path tokens);

  [[nodiscard]] const PeerRoles& peers() const { return peers_; }
  /// Reads the file of tokens again. Unreadable tokens are void. Touches the disk.
  void refresh();
  /// Why tokens are void.
  [[nodiscard]] std::optional<Error> problem() const;
  /// `authorization` is the header's value. With one, only the token decides; without one,
  /// `peer`.
  [[nodiscard]] std::optional<Role> role_of(std::optional<Role> peer, std::string_view authorization) const;

 private:
  struct Known {
    TokenFile tokens;
    std::optional<Error> problem{};
  };
  [[nodiscard]] std::shared_ptr<const Known> known() const;

  PeerRoles peers_;
  std::filesystem::path path_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Known> known_;
};

}  // namespace scanrig
