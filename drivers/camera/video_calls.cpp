#include "drivers/camera/video_calls.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

namespace scanrig {
namespace {

class Kernel final : public VideoCalls {
 public:
  int open(const std::string& device) override { return ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); }
  int close(int descriptor) override { return ::close(descriptor); }
  int control(int descriptor, unsigned long request, void* argument) override {
    int result = 0;
    do {
      result = ::ioctl(descriptor, request, argument);
    } while (result < 0 && errno == EINTR);
    return result;
  }
  void* map(int descriptor, std::size_t length, long offset) override {
    return ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, offset);
  }
  int unmap(void* address, std::size_t length) override { return ::munmap(address, length); }
  int wait(int descriptor, int timeout_ms) override {
    pollfd watched{descriptor, POLLIN, 0};
    return ::poll(&watched, 1, timeout_ms);
  }
};

}  // namespace

VideoCalls& kernel_video() {
  static Kernel kernel;
  return kernel;
}

}  // namespace scanrig
