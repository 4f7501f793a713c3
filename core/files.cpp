#include "core/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <tuple>
#include <vector>

namespace scanrig {
namespace {

constexpr const char* kTemporary = ".tmp";  // between a file's name and the number of its process

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

tl::unexpected<Error> fail_errno(const char* doing, const std::filesystem::path& path) {
  return fail(ErrorCode::io, "{} {}: {}", doing, path.string(), std::strerror(errno));
}

Result<void> sync_folder(const std::filesystem::path& folder) {
  const Descriptor fd(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0 || ::fsync(fd.get()) != 0) return fail_errno("cannot sync the folder", folder);
  return {};
}

Result<void> write_all(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const Descriptor fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (fd.get() < 0) return fail_errno("cannot create", path);
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return fail_errno("cannot write", path);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> sync_file(const std::filesystem::path& path) {
  const Descriptor fd(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (fd.get() < 0 || ::fsync(fd.get()) != 0) return fail_errno("cannot sync", path);
  return {};
}

}  // namespace

Result<std::string> read_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return fail(ErrorCode::not_found, "no such file: {}", path.string());
  if (std::filesystem::is_directory(path, error))
    return fail(ErrorCode::io, "{} is a folder, not a file", path.string());
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  if (stream) text << stream.rdbuf();
  if (!stream) return fail(ErrorCode::io, "cannot read {}", path.string());
  return std::move(text).str();
}

std::vector<std::filesystem::path> unfinished_writes(const std::filesystem::path& path) {
  const std::string begins = path.filename().string() + kTemporary;
  std::vector<std::filesystem::path> found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path.parent_path(), ignored)) {
    if (entry.path().filename().string().starts_with(begins)) found.push_back(entry.path());
  }
  return found;
}

Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::filesystem::path temporary = path;
  temporary += fmt::format("{}{}", kTemporary, ::getpid());
  auto written = write_all(temporary, bytes);
  if (written) written = sync_file(temporary);
  if (written && ::rename(temporary.c_str(), path.c_str()) != 0) {
    written = Result<void>(fail_errno("cannot rename to", path));
  }
  if (!written) {
    ::unlink(temporary.c_str());
    return written;
  }
  return sync_folder(path.parent_path());
}

Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view text) {
  return write_file_atomically(path, std::as_bytes(std::span(text.data(), text.size())));
}

Result<void> write_files_synced(const std::filesystem::path& folder, std::span<const FileContent> files) {
  for (const FileContent& file : files) {
    if (auto written = write_all(folder / file.name, file.bytes); !written) return written;
  }
  for (const FileContent& file : files) {
    if (auto synced = sync_file(folder / file.name); !synced) return synced;
  }
  return sync_folder(folder);
}

Result<void> remove_file_synced(const std::filesystem::path& path) {
  if (::unlink(path.c_str()) == 0) return sync_folder(path.parent_path());
  return errno == ENOENT ? Result<void>() : fail_errno("cannot remove", path);
}

Result<void> create_directories_synced(const std::filesystem::path& path) {
  std::error_code error;
  if (path.empty()) return {};
  if (std::filesystem::exists(path, error)) {
    // A crash between creating a folder and syncing its name leaves this state. A parent that may not be read belongs
    // to another user.
    std::ignore = sync_folder(path.parent_path());
    return {};
  }
  if (auto parent = create_directories_synced(path.parent_path()); !parent) return parent;
  if (!std::filesystem::create_directory(path, error) && error) {
    return fail(ErrorCode::io, "cannot create the folder {}: {}", path.string(), error.message());
  }
  return sync_folder(path.parent_path());
}

Result<void> replace_folder(const std::filesystem::path& prepared, const std::filesystem::path& target) {
  std::error_code error;
  if (!std::filesystem::exists(target, error)) {
    if (::rename(prepared.c_str(), target.c_str()) != 0) return fail_errno("cannot rename to", target);
    return sync_folder(target.parent_path());
  }
  std::filesystem::path old = prepared;
  if (::renameat2(AT_FDCWD, prepared.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) != 0) {
    if (errno != EINVAL && errno != ENOSYS) return fail_errno("cannot exchange", target);
    old += ".old";
    if (::rename(target.c_str(), old.c_str()) != 0) return fail_errno("cannot move away", target);
    if (::rename(prepared.c_str(), target.c_str()) != 0) {
      auto failed = fail_errno("cannot rename to", target);
      ::rename(old.c_str(), target.c_str());
      return failed;
    }
  }
  if (auto synced = sync_folder(target.parent_path()); !synced) return synced;
  std::filesystem::remove_all(old, error);
  if (error) return fail(ErrorCode::io, "cannot remove the replaced folder {}: {}", old.string(), error.message());
  return {};
}

}  // namespace scanrig
