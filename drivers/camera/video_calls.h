#pragma once

#include <cstddef>
#include <string>

namespace scanrig {

/// System calls that drive a V4L2 device, as in man 2; errors as there, through errno.
/// Threads: one owner for each descriptor.
class VideoCalls {
 public:
  virtual ~VideoCalls() = default;
  virtual int open(const std::string& device) = 0;
  virtual int close(int descriptor) = 0;
  virtual int control(int descriptor, unsigned long request, void* argument) = 0;  ///< ioctl
  virtual void* map(int descriptor, std::size_t length, long offset) = 0;          ///< shared; MAP_FAILED
  virtual int unmap(void* address, std::size_t length) = 0;
  /// Waits until a frame or an event is available: above 0; 0: not within `timeout_ms`.
  virtual int wait(int descriptor, int timeout_ms) = 0;
};

/// The calls of the kernel.
VideoCalls& kernel_video();

}  // namespace scanrig
