#include "daemon/api/logins.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/hash.h"
#include "core/secrets.h"
#include "core/timestamp.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;
using std::chrono::hours;
using std::chrono::minutes;

constexpr auto kIdle = hours(12), kLife = hours(24 * 30);
constexpr auto kClockSlack = hours(24);  ///< a login of the future is void: the clock was set back
constexpr auto kCodeLife = minutes(2), kTryWindow = minutes(1);
constexpr std::size_t kMaxLogins = 256, kMaxCodes = 32, kMaxTries = 10, kMaxAddresses = 4096;
constexpr std::string_view kFormat = "scanrig-logins";

bool is_same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

Logins::Logins(std::filesystem::path file) : file_(std::move(file)) { read(std::chrono::system_clock::now()); }

Result<std::string> Logins::begin(const LoginSource& source, Time now) {
  auto cookie = random_hexadecimal(32);
  if (!cookie) return cookie;
  const auto hash = sha256(*cookie);
  {
    const std::lock_guard guard(mutex_);
    if (logins_.size() == kMaxLogins) logins_.erase(std::ranges::min_element(logins_, {}, &Login::used));
    logins_.push_back({.sha256 = hash, .source = source, .begun = now, .used = now});
  }
  if (auto written = write(); !written) {
    forget(hash);
    return pass_on(written);
  }
  return cookie;
}

void Logins::forget(const std::string& hash) {
  const std::lock_guard guard(mutex_);
  std::erase_if(logins_, [&](const Login& login) { return is_same(login.sha256, hash); });
}

std::optional<LoginSource> Logins::find(std::string_view cookie, Time now) {
  if (cookie.empty()) return std::nullopt;
  const auto hash = sha256(cookie);
  const std::lock_guard guard(mutex_);
  const auto found = std::ranges::find_if(logins_, [&](const Login& login) { return is_same(login.sha256, hash); });
  if (found == logins_.end() || now - found->begun > kLife || found->begun - now > kClockSlack) return std::nullopt;
  auto source = found->source;
  if (!source.kiosk && now - found->used > kIdle) {
    source.role = Role::viewer;  // and stays so: only a new login makes it more
  } else {
    found->used = now;
  }
  return source;
}

Result<void> Logins::end(std::string_view cookie) {
  forget(sha256(cookie));
  return write();
}

Result<std::string> Logins::offer_code(const LoginSource& source, Time now) {
  auto code = random_code();
  if (!code) return code;
  const std::lock_guard guard(mutex_);
  std::erase_if(codes_, [&](const Code& one) { return now - one.offered > kCodeLife || one.offered > now; });
  if (codes_.size() == kMaxCodes) return fail(ErrorCode::busy, "too many codes are open: wait two minutes");
  codes_.push_back({*code, source, now});
  return code;
}

std::optional<LoginSource> Logins::take_code(std::string_view code, Time now) {
  const std::lock_guard guard(mutex_);
  const auto found = std::ranges::find_if(codes_, [&](const Code& one) { return is_same(one.text, code); });
  if (found == codes_.end()) return std::nullopt;
  const auto taken = *found;
  codes_.erase(found);
  if (now - taken.offered > kCodeLife || taken.offered > now) return std::nullopt;
  return taken.source;
}

bool Logins::may_try(const std::string& address, Time now) {
  const std::lock_guard guard(mutex_);
  if (tries_.size() >= kMaxAddresses) {
    std::erase_if(tries_, [&](const auto& one) { return now - one.second.back() > kTryWindow; });
  }
  auto& tries = tries_[address];
  while (!tries.empty() && now - tries.front() > kTryWindow) tries.pop_front();
  if (tries.size() >= kMaxTries) return false;
  tries.push_back(now);
  return true;
}

/// A slow disk holds up only other logins.
Result<void> Logins::write() {
  if (file_.empty()) return {};
  const std::lock_guard only_writer(writing_);
  std::vector<Login> logins;
  {
    const std::lock_guard guard(mutex_);
    logins = logins_;
  }
  ordered_json json{{"format", kFormat}, {"version", 1}, {"logins", ordered_json::array()}};
  for (const auto& login : logins) {
    json["logins"].push_back({{"sha256", login.sha256},
                              {"token", login.source.token},
                              {"proof", login.source.proof},
                              {"role", to_string(login.source.role)},
                              {"kiosk", login.source.kiosk},
                              {"begun", iso_time(login.begun)}});
  }
  return write_private_file(file_, json.dump(1) + "\n");
}

void Logins::read(Time now) {
  if (file_.empty() || !check_private(file_)) return;
  const auto text = read_file(file_);
  if (!text) return;
  const auto json = ordered_json::parse(*text, nullptr, false);
  if (!json.is_object() || json.value("format", ordered_json()) != kFormat ||
      json.value("version", ordered_json()) != 1) {
    return;
  }
  for (const auto& entry : json.value("logins", ordered_json::array())) {
    const auto text_of = [&](const char* key) {
      return entry.is_object() && entry.contains(key) && entry[key].is_string() ? entry[key].get<std::string>() : "";
    };
    const auto role = parse_role(text_of("role"));
    const auto begun = parse_iso_time(text_of("begun"));
    if (!role || !begun || text_of("sha256").empty() || logins_.size() == kMaxLogins) continue;
    logins_.push_back({.sha256 = text_of("sha256"),
                       .source = {.token = text_of("token"),
                                  .proof = text_of("proof"),
                                  .role = *role,
                                  .kiosk = entry.value("kiosk", ordered_json()) == true},
                       .begun = *begun,
                       .used = now});
  }
}

}  // namespace scanrig
