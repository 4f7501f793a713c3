#include "daemon/api/access.h"

#include <openssl/crypto.h>
#include <strings.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/hash.h"
#include "core/secrets.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t kMaxTokens = 256;
constexpr std::string_view kHexadecimal = "0123456789abcdef";

bool is_hexadecimal(const std::string& text, std::size_t digits) {
  return text.size() == digits && text.find_first_not_of(kHexadecimal) == std::string::npos;
}

bool is_name(const std::string& name) {
  const auto allowed = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 32 && std::ranges::all_of(name, allowed);
}

std::optional<TokenRecord> parse_record(const ordered_json& json) {
  const auto text = [&](const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
  };
  TokenRecord record{.name = text("name"), .created = text("created"), .salt = text("salt"), .sha256 = text("sha256")};
  const auto role = parse_role(text("role"));
  if (!role || !is_name(record.name) || !is_hexadecimal(record.salt, 32) || !is_hexadecimal(record.sha256, 64)) {
    return std::nullopt;
  }
  record.role = *role;
  return record;
}

}  // namespace

Result<TokenFile> TokenFile::read(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) return TokenFile();
  if (auto is_private = check_private(path); !is_private) return pass_on(is_private);
  const auto text = read_file(path);
  if (!text) return pass_on(text);
  const auto json = ordered_json::parse(*text, nullptr, false);
  if (!json.is_object() || json.value("format", ordered_json()) != "scanrig-tokens" ||
      json.value("version", ordered_json()) != 1 || !json.contains("tokens") || !json["tokens"].is_array() ||
      json["tokens"].size() > kMaxTokens) {
    return fail(ErrorCode::invalid_input, "{}: not a file of tokens (scanrig token add writes one)", path.string());
  }
  TokenFile file;
  for (const auto& entry : json["tokens"]) {
    const auto record = parse_record(entry);
    if (!record) {
      return fail(ErrorCode::invalid_input, "{}: token {} cannot be understood", path.string(),
                  file.records_.size() + 1);
    }
    file.records_.push_back(*record);
  }
  return file;
}

const TokenRecord* TokenFile::find(std::string_view token) const {
  const TokenRecord* found = nullptr;
  for (const auto& record : records_) {
    const std::string hash = sha256(record.salt + std::string(token));
    if (CRYPTO_memcmp(hash.data(), record.sha256.data(), hash.size()) == 0) found = &record;
  }
  return found;
}

std::optional<Role> TokenFile::role_of(std::string_view token) const {
  const auto* record = find(token);
  return record == nullptr ? std::nullopt : std::optional(record->role);
}

Result<std::string> TokenFile::add(const std::string& name, Role role, std::string created) {
  if (!is_name(name)) {
    return fail(ErrorCode::invalid_input, "\"{}\": a token's name is 1 to 32 letters, digits, \".\", \"_\" or \"-\"",
                name);
  }
  if (std::ranges::find(records_, name, &TokenRecord::name) != records_.end()) {
    return fail(ErrorCode::exists, "there is a token {} already: revoke it first", name);
  }
  if (records_.size() == kMaxTokens) return fail(ErrorCode::invalid_input, "there are {} tokens already", kMaxTokens);
  const auto secret = random_hexadecimal(32);
  const auto salt = random_hexadecimal(16);
  if (!secret || !salt) return pass_on(secret ? salt : secret);
  std::string token = "scanrig_" + *secret;
  records_.push_back({name, role, std::move(created), *salt, sha256(*salt + token)});
  return token;
}

Result<void> TokenFile::revoke(const std::string& name) {
  const auto removed = std::erase_if(records_, [&](const TokenRecord& record) { return record.name == name; });
  if (removed == 0) return fail(ErrorCode::not_found, "there is no token {}", name);
  return {};
}

Result<void> TokenFile::write(const fs::path& path) const {
  ordered_json json{{"format", "scanrig-tokens"}, {"version", 1}, {"tokens", ordered_json::array()}};
  for (const auto& r : records_) {
    json["tokens"].push_back({{"name", r.name},
                              {"role", to_string(r.role)},
                              {"created", r.created},
                              {"salt", r.salt},
                              {"sha256", r.sha256}});
  }
  return write_private_file(path, json.dump(2) + "\n");
}

Access::Access(PeerRoles peers, fs::path tokens, fs::path logins)
    : peers_(peers), logins_(std::move(logins)), path_(std::move(tokens)) {
  refresh();
}

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

Identity Access::identify(std::optional<Role> peer, std::string_view authorization, std::string_view cookie, Time now) {
  constexpr std::string_view kScheme = "Bearer ";
  if (authorization.empty()) {
    const auto login = logins_.find(cookie, now);
    const auto valid = login ? still_valid(*login) : std::nullopt;
    if (valid) return {.role = valid->role, .token = valid->token, .cookie = std::string(cookie)};
    return {.role = peer};
  }
  if (authorization.size() < kScheme.size() ||
      ::strncasecmp(authorization.data(), kScheme.data(), kScheme.size()) != 0) {
    return {};
  }
  const auto all = known();
  const auto* record = all->tokens.find(authorization.substr(kScheme.size()));
  return record == nullptr ? Identity{} : Identity{.role = record->role, .token = record->name};
}

/// A login ends with its token, and never may more than it.
std::optional<LoginSource> Access::still_valid(LoginSource source) const {
  if (source.token.empty()) return source;
  const auto all = known();
  const auto record = std::ranges::find(all->tokens.records(), source.token, &TokenRecord::name);
  if (record == all->tokens.records().end() || record->sha256 != source.proof) return std::nullopt;
  source.role = std::min(source.role, record->role);
  return source;
}

Result<std::optional<std::string>> Access::log_in_by_token(std::string_view token, Time now) {
  const auto all = known();
  const auto* record = all->tokens.find(token);
  if (record == nullptr) return std::nullopt;
  return logins_.begin({.token = record->name, .proof = record->sha256, .role = record->role}, now);
}

Result<std::optional<std::string>> Access::log_in_by_code(std::string_view code, Time now) {
  const auto source = logins_.take_code(code, now);
  if (!source || !still_valid(*source)) return std::nullopt;
  return logins_.begin(*source, now);
}

Result<std::string> Access::offer_code(const Identity& who, Role role, bool kiosk, Time now) {
  if (!who.role || role > *who.role) {
    return fail(ErrorCode::refused, "a code gives at most your own role{}",
                who.role ? fmt::format(", {}", to_string(*who.role)) : "");
  }
  LoginSource source{.token = who.token, .role = role, .kiosk = kiosk};
  const auto all = known();
  const auto record = std::ranges::find(all->tokens.records(), who.token, &TokenRecord::name);
  if (record != all->tokens.records().end()) source.proof = record->sha256;
  return logins_.offer_code(source, now);
}

std::shared_ptr<const Access::Known> Access::known() const {
  const std::lock_guard guard(mutex_);
  return known_;
}

}  // namespace scanrig
