#include "core/secrets.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHexadecimal = "0123456789abcdef";
constexpr std::string_view kLegible = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ";  ///< 32 of them, without 0 1 I O
constexpr std::size_t kCodeLength = 8;

Result<std::string> random_bytes(std::size_t count) {
  std::string raw(count, '\0');
  if (RAND_bytes(reinterpret_cast<unsigned char*>(raw.data()), static_cast<int>(count)) != 1) {
    return fail(ErrorCode::io, "the system gives no random numbers");
  }
  return raw;
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

}  // namespace

Result<std::string> random_hexadecimal(std::size_t bytes) {
  auto raw = random_bytes(bytes);
  if (!raw) return raw;
  std::string text;
  for (const char c : *raw) {
    const auto byte = static_cast<unsigned char>(c);
    text += {kHexadecimal[byte >> 4], kHexadecimal[byte & 15]};
  }
  OPENSSL_cleanse(raw->data(), raw->size());
  return text;
}

Result<std::string> random_code() {
  auto raw = random_bytes(kCodeLength);
  if (!raw) return raw;
  std::string code;
  for (const char c : *raw) code += kLegible[static_cast<unsigned char>(c) % kLegible.size()];
  return code;
}

/// A reader of the file could try to guess tokens; a writer would be an engineer.
Result<void> check_private(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return fail(ErrorCode::io, "{}: cannot be looked at: {}", path.string(), std::strerror(errno));
  }
  if ((status.st_mode & 077) != 0) {
    return fail(ErrorCode::refused, "{}: mode {:04o} lets others read or change it: chmod 600 it", path.string(),
                status.st_mode & 07777);
  }
  if (status.st_uid != ::geteuid() && status.st_uid != 0) {
    return fail(ErrorCode::refused, "{}: belongs to another user: chown it", path.string());
  }
  return {};
}

Result<void> write_private_file(const fs::path& path, const std::string& text) {
  const auto before = ::umask(077);
  auto written = write_file_atomically(path, text);
  ::umask(before);
  return written && ::geteuid() == 0 ? give_to_owner_of_folder(path) : written;
}

}  // namespace scanrig
