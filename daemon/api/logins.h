#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "daemon/api/roles.h"

namespace scanrig {

/// What a login stands for: the token it was exchanged for, or a user of this machine that offered a code.
struct LoginSource {
  std::string token{};  ///< its name; empty: a user of this machine
  std::string proof{};  ///< the stored hash of that token: another one of the same name is another source
  Role role = Role::viewer;
  bool kiosk = false;  ///< keeps its role while it is idle

  bool operator==(const LoginSource&) const = default;
};

/// Browsers that have logged in, each by a cookie, and the codes by which they may. Cookies are 256 random bits of
/// which the file keeps a hash: logins outlive a daemon that was killed. Times are the system clock's; idleness is
/// counted since the daemon started. Threads: any.
class Logins {
 public:
  using Time = std::chrono::system_clock::time_point;

  /// `file`: mode 0600, replaced as a whole; empty: nothing is kept. An unreadable one is as none.
  explicit Logins(std::filesystem::path file);

  /// The cookie of a new login, durable. The oldest login makes room for it. Touches the disk. Fails with `io`.
  Result<std::string> begin(const LoginSource& source, Time now);
  /// The login that `cookie` stands for, its role lowered to viewer after 12 h without a request; nothing after 30
  /// days. Every call is a request of it.
  std::optional<LoginSource> find(std::string_view cookie, Time now);
  /// Touches the disk. Fails with `io`.
  Result<void> end(std::string_view cookie);

  /// A code of 8 characters for one login within 2 minutes. Fails with `io`, `busy` (too many are open).
  Result<std::string> offer_code(const LoginSource& source, Time now);
  /// What the code was offered for; it is used up.
  std::optional<LoginSource> take_code(std::string_view code, Time now);

  /// Counts a try to log in. False: there were ten of this address within a minute.
  bool may_try(const std::string& address, Time now);

 private:
  struct Login {
    std::string sha256;
    LoginSource source;
    Time begun{};
    Time used{};
  };
  struct Code {
    std::string text;
    LoginSource source;
    Time offered{};
  };
  [[nodiscard]] Result<void> write();
  void read(Time now);
  void forget(const std::string& hash);

  const std::filesystem::path file_;
  std::mutex writing_;  ///< taken before mutex_
  std::mutex mutex_;
  std::vector<Login> logins_;
  std::vector<Code> codes_;
  std::map<std::string, std::deque<Time>> tries_;
};

}  // namespace scanrig
