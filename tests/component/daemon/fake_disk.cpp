#include "tests/component/daemon/fake_disk.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

namespace scanrig::fakes {

FakeDisk& disk() {
  static FakeDisk only;
  return only;
}

}  // namespace scanrig::fakes

extern "C" int fsync(int file) {
  std::error_code ignored;
  const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file), ignored);
  if (const int error = scanrig::fakes::disk().sync(path); error != 0) {
    errno = error;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fsync, file));
}
