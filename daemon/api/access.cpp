#include "daemon/api/access.h"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "core/files.h"
#include "core/hash.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t kMaxTokens = 256;
constexpr std::string_view kHexadecimal = "0123456789abcdef";

Result<std::string> random_hexadecimal(std::size_t bytes) {
  std::string raw(bytes, '\0');
  if (RAND_bytes(reinterpret_cast<unsigned char*>(raw.data()), static_cast<int>(bytes)) != 1) {
    return fail(ErrorCode::io, "the system gives no random numbers");
  }
  std::string text;
  for (const char c : raw) {
    const auto byte = static_cast<unsigned char>(c);
    text += {kHexadecimal[byte >> 4], kHexadecimal[byte & 15]};
  }
  OPENSSL_cleanse(raw.data(), raw.size());
  return text;
}

bool is_hexadecimal(const std::string& text, std::size_t digits) {
  return text.size() == digits && text.find_first_not_of(kHexadecimal) == std::string::npos;
}

bool is_name(const std::string& name) {
  const auto allowed = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 32 && std::ranges::all_of(name, allowed);
}

/// A reader of the file could try to guess tokens; a writer would be an engineer.
Result<void> check_private(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return fail(ErrorCode::io, "{}: cannot be looked at: {}", path.string(), std::strerror(errno));
  }
  if ((status.st_mode & 077) != 0) {
    return fail(ErrorCode::refused, "{}: mode {:04o} lets others at the tokens: chmod 600 it", path.string(),
                status.st_mode & 07777);
  }
  if (status.st_uid != ::geteuid() && status.st_uid != 0) {
    return fail(ErrorCode::refused, "{}: belongs to another user: chown it", path.string());
  }
  return {};
}

/// The daemon reads a file that root has written in the daemon's folder.
Result<void> give_to_owner_of_folder(const fs::path& path) {
  struct stat folder {};
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (::stat(parent.c_str(), &folder) != 0 || ::chown(path.c_str(), folder.st_uid, folder.st_gid) != 0) {
    return fail(ErrorCode::io, "{}: cannot be given to the owner of its folder: {}", path.string(),
                std::strerror(errno));
  }
  return {};
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

std::optional<Role> TokenFile::role_of(std::string_view token) const {
  std::optional<Role> role;
  for (const auto& record : records_) {
    const std::string hash = sha256(record.salt + std::string(token));
    if (CRYPTO_memcmp(hash.data(), record.sha256.data(), hash.size()) == 0) role = record.role;
  }
  return role;
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
  const auto before = ::umask(077);
  auto written = write_file_atomically(path, json.dump(2) + "\n");
  ::umask(before);
  return written && ::geteuid() == 0 ? give_to_owner_of_folder(path) : written;
}

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
