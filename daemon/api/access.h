#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "daemon/api/logins.h"
#include "daemon/api/roles.h"

namespace scanrig {

/// One token as the file keeps it. The token itself is 256 random bits and is not stored: a fast hash is enough.
struct TokenRecord {
  std::string name;
  Role role = Role::viewer;
  std::string created;  ///< "2026-11-21T09:30:00Z"
  std::string salt;     ///< 32 hexadecimal digits
  std::string sha256;   ///< of salt + token
};

/// The tokens of the API. A file of mode 0600 (or less), JSON, replaced as a whole.
class TokenFile {
 public:
  /// A missing file has no tokens. Fails with `io`, `refused` (others may read or write it, or it is neither
  /// the caller's nor root's), `invalid_input`.
  static Result<TokenFile> read(const std::filesystem::path& path);

  /// Role of the bearer of `token`. Takes the same time whichever token it is, or none.
  [[nodiscard]] std::optional<Role> role_of(std::string_view token) const;
  /// The record of `token`, likewise; null where there is none.
  [[nodiscard]] const TokenRecord* find(std::string_view token) const;

  /// Adds a token and returns it, "scanrig_..." - shown once. Names are 1 to 32 of A-Z a-z 0-9 . _ -
  /// Fails with `exists`, `invalid_input`.
  Result<std::string> add(const std::string& name, Role role, std::string created);
  Result<void> revoke(const std::string& name);  ///< fails with `not_found`
  /// Durable, mode 0600. Fails with `io`.
  [[nodiscard]] Result<void> write(const std::filesystem::path& path) const;

  [[nodiscard]] const std::vector<TokenRecord>& records() const { return records_; }

 private:
  std::vector<TokenRecord> records_;
};

/// Decides what a client may do. Threads: any.
class Access {
 public:
  using Time = Logins::Time;

  /// `tokens`: the file; empty: no tokens. `logins`: the file of logins; empty: they end with the process.
  Access(PeerRoles peers, std::filesystem::path tokens, std::filesystem::path logins = {});

  [[nodiscard]] const PeerRoles& peers() const { return peers_; }
  /// Reads the file of tokens again. Unreadable tokens are void. Touches the disk.
  void refresh();
  /// Why tokens are void.
  [[nodiscard]] std::optional<Error> problem() const;
  /// `authorization` is the header's value. With one, only the token decides; without one the `cookie`, without that
  /// `peer`. A cookie that is not known is as none.
  [[nodiscard]] Identity identify(std::optional<Role> peer, std::string_view authorization, std::string_view cookie,
                                  Time now);

  /// A cookie in exchange for a token or a code; nothing where it is not known. Touches the disk. Fails with `io`.
  Result<std::optional<std::string>> log_in_by_token(std::string_view token, Time now);
  Result<std::optional<std::string>> log_in_by_code(std::string_view code, Time now);
  Result<void> log_out(std::string_view cookie) { return logins_.end(cookie); }
  bool may_try_to_log_in(const std::string& address, Time now) { return logins_.may_try(address, now); }
  /// A code by which a browser may log in once, with at most the rights of `who`. Fails with `io`, `busy`, `refused`.
  Result<std::string> offer_code(const Identity& who, Role role, bool kiosk, Time now);

 private:
  struct Known {
    TokenFile tokens;
    std::optional<Error> problem{};
  };
  [[nodiscard]] std::shared_ptr<const Known> known() const;
  [[nodiscard]] std::optional<LoginSource> still_valid(LoginSource source) const;

  PeerRoles peers_;
  Logins logins_;
  std::filesystem::path path_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Known> known_;
};

}  // namespace scanrig
