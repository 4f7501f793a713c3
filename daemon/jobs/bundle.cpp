#include "daemon/jobs/bundle.h"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>
#include <utility>

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

/// What is half packed when the packing ends in whatever way.
class Remains {
 public:
  explicit Remains(fs::path file) : file_(std::move(file)) {}
  ~Remains() {
    std::error_code ignored;
    fs::remove(file_, ignored);
  }
  Remains(const Remains&) = delete;
  Remains& operator=(const Remains&) = delete;

 private:
  fs::path file_;
};

}  // namespace

Result<void> bundle(const fs::path& job_folder, const fs::path& target, const Context& context) {
  std::error_code ignored;
  if (!target.is_absolute()) {
    return fail(ErrorCode::invalid_input, "bundle: \"{}\" is not an absolute path", target.string());
  }
  if (fs::exists(target, ignored)) return fail(ErrorCode::exists, "bundle: {} is already there", target.string());
  fs::path prepared = target;
  prepared += ".part";
  const Remains remains(prepared);
  const auto packed = run_child({.words = {kTar, "--create", "--gzip", "--file", prepared.string(), "--directory",
                                           job_folder.parent_path().string(), job_folder.filename().string()},
                                 .limit = kLimit},
                                context.stop);
  if (!packed) return pass_on(packed, "bundle");
  if (packed->code != 0) {
    return fail(ErrorCode::io, "bundle: cannot write {}: {}", target.string(), packed->last_words);
  }
  if (auto synced = sync(prepared); !synced) return synced;
  return replace_folder(prepared, target);
}

}  // namespace scanrig
