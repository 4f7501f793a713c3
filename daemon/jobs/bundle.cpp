#include "daemon/jobs/bundle.h"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>

#include "core/files.h"
#include "daemon/jobs/child_process.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTar = "/bin/tar";
constexpr auto kLimit = std::chrono::minutes(30);

Result<void> sync(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  if (synced) return {};
  return fail(ErrorCode::io, "cannot write {}", file.string());
}

}  // namespace

Result<void> bundle(const fs::path& job_folder, const fs::path& target, const Context& context) {
  std::error_code ignored;
  if (!target.is_absolute()) {
    return fail(ErrorCode::invalid_input, "bundle: \"{}\" is not an absolute path", target.string());
  }
  if (fs::exists(target, ignored)) return fail(ErrorCode::exists, "bundle: {} is already there", target.string());
  fs::path prepared = target;
  prepared += ".part";
  const auto packed = run_child({.words = {kTar, "--create", "--gzip", "--file", prepared.string(), "--directory",
                                           job_folder.parent_path().string(), job_folder.filename().string()},
                                 .limit = kLimit},
                                context.stop);
  Result<void> done;
  if (!packed) {
    done = pass_on(packed, "bundle");
  } else if (packed->code != 0) {
    done = fail(ErrorCode::io, "bundle: cannot write {}: {}", target.string(), packed->last_words);
  } else {
    done = sync(prepared);
  }
  if (done) done = replace_folder(prepared, target);
  if (!done) fs::remove(prepared, ignored);
  return done;
}

}  // namespace scanrig
