// Preloaded into a daemon: a disk that syncs slowly and a wall clock that jumps, as a file states at run time.
// SCANRIG_DISTURB names the file: two 64-bit numbers, milliseconds that each fsync takes and seconds that the wall
// clock is ahead.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace {

struct Disturbance {
  std::atomic<std::int64_t> fsync_ms;
  std::atomic<std::int64_t> ahead_s;
};

const Disturbance* disturbance() {
  static const Disturbance* const told = []() -> const Disturbance* {
    const char* name = std::getenv("SCANRIG_DISTURB");
    const int file = name != nullptr ? ::open(name, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0) return nullptr;
    void* at = ::mmap(nullptr, sizeof(Disturbance), PROT_READ, MAP_SHARED, file, 0);
    ::close(file);
    return at == MAP_FAILED ? nullptr : static_cast<const Disturbance*>(at);
  }();
  return told;
}

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int fsync(int file) {
  static auto* const call = real<int(int)>("fsync");
  if (const auto* told = disturbance()) {
    const std::int64_t ms = told->fsync_ms;
    const timespec wait{ms / 1000, ms % 1000 * 1'000'000};
    ::nanosleep(&wait, nullptr);
  }
  return call(file);
}

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static auto* const call = real<int(clockid_t, timespec*)>("clock_gettime");
  const int done = call(clock, time);
  if (clock == CLOCK_REALTIME) {
    if (const auto* told = disturbance()) time->tv_sec += told->ahead_s;
  }
  return done;
}
