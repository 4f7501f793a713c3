#pragma once

#include <linux/videodev2.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "core/clock.h"
#include "drivers/camera/video_calls.h"

namespace scanrig {

/// A V4L2 device of the tests, behind the same calls as the kernel's. Buffers, sequence numbers and stamps follow the
/// V4L2 documentation. The test determines when frames come.
/// Threads: every function may be called from any thread.
class ScriptedVideo final : public VideoCalls {
 public:
  struct Frame {
    std::vector<std::uint8_t> bytes;
    std::uint32_t sequence = 0;
    Clock::TimePoint stamp;
    Clock::TimePoint due;
    std::uint32_t flags = 0;  ///< in addition to the kind of stamp
  };

  explicit ScriptedVideo(Clock& clock) : clock_(clock) {}

  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::uint32_t stamps = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  bool other_size = false;                       ///< replies to S_FMT with another size
  std::map<std::uint32_t, int> known;            ///< controls and their values
  std::map<std::uint32_t, int> limit;            ///< largest value of a control
  std::map<std::uint32_t, int> step;             ///< of a control: values are rounded down to a multiple
  std::map<std::uint32_t, std::uint32_t> flags;  ///< of a control
  std::map<std::uint32_t, std::pair<std::uint32_t, int>> side_effects;  ///< a control that changes another one
  bool keeps_other_size = false;                                        ///< confirms S_FMT, and keeps another size

  void add(const std::string& device) { devices_[device]; }
  void deliver(const std::string& device, Frame frame);
  void plug(const std::string& device, bool in);
  [[nodiscard]] int open_descriptors() const;

  int open(const std::string& device) override;
  int close(int descriptor) override;
  int control(int descriptor, unsigned long request, void* argument) override;
  void* map(int descriptor, std::size_t length, long offset) override;
  int unmap(void*, std::size_t) override { return 0; }
  int wait(int descriptor, int timeout_ms) override;

 private:
  struct Device {
    bool there = true;
    bool streaming = false;
    int descriptor = -1;
    std::size_t length = 0;
    std::vector<std::vector<std::uint8_t>> buffers;
    std::deque<std::uint32_t> queued;
    std::deque<Frame> frames;
  };

  Device* of(int descriptor);
  [[nodiscard]] bool due(const Device& device) const;
  int take(Device& device, v4l2_buffer& buffer);
  int set_control(const v4l2_control& control);
  int read_control(v4l2_control& control);

  Clock& clock_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Device> devices_;
  int next_descriptor_ = 1000;
};

}  // namespace scanrig
