#include "daemon/jobs/publish.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

Result<void> sync(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::fsync(fd) == 0;
  const int reason = errno;
  if (fd >= 0) ::close(fd);
  if (!synced) return fail(ErrorCode::io, "cannot sync {}: {}", path.string(), std::strerror(reason));
  return {};
}

Result<void> sync_all(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator next(folder, error), end; !error && next != end; next.increment(error)) {
    if (auto synced = sync(next->path()); !synced) return synced;
  }
  if (error) return fail(ErrorCode::io, "cannot list {}: {}", folder.string(), error.message());
  return sync(folder);
}

}  // namespace

Result<void> publish_folder(const fs::path& folder, const std::function<Result<void>(const fs::path&)>& write) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    return fail(ErrorCode::exists, "{}: already there; name another folder or remove this one", folder.string());
  }
  fs::path temporary = folder;
  temporary += fmt::format(".tmp{}", ::getpid());
  fs::remove_all(temporary, error);
  if (auto made = create_directories_synced(temporary); !made) return made;
  auto done = write(temporary);
  if (done) done = sync_all(temporary);
  if (done && ::rename(temporary.c_str(), folder.c_str()) != 0) {
    done = fail(ErrorCode::io, "cannot rename {} to {}: {}", temporary.string(), folder.string(), std::strerror(errno));
  }
  if (!done) {
    fs::remove_all(temporary, error);
    return done;
  }
  return sync(folder.has_parent_path() ? folder.parent_path() : fs::path("."));
}

}  // namespace scanrig
