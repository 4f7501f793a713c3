#include "tests/component/camera/scripted_video.h"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace scanrig {
namespace {

int refuse(int reason) {
  errno = reason;
  return -1;
}

}  // namespace

void ScriptedVideo::deliver(const std::string& device, Frame frame) {
  const std::scoped_lock lock(mutex_);
  if (devices_[device].streaming) devices_[device].frames.push_back(std::move(frame));
  clock_.notify_all(changed_);
}

void ScriptedVideo::plug(const std::string& device, bool in) {
  const std::scoped_lock lock(mutex_);
  devices_[device].there = in;
  devices_[device].frames.clear();
  if (!in) devices_[device].streaming = false;
  clock_.notify_all(changed_);
}

int ScriptedVideo::open_descriptors() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<int>(
      std::ranges::count_if(devices_, [](const auto& device) { return device.second.descriptor >= 0; }));
}

ScriptedVideo::Device* ScriptedVideo::of(int descriptor) {
  for (auto& [name, device] : devices_) {
    if (device.descriptor == descriptor) return &device;
  }
  return nullptr;
}

bool ScriptedVideo::due(const Device& device) const {
  return std::ranges::any_of(device.frames, [&](const Frame& frame) { return frame.due <= clock_.now(); });
}

int ScriptedVideo::open(const std::string& name) {
  const std::scoped_lock lock(mutex_);
  const auto found = devices_.find(name);
  if (found == devices_.end() || !found->second.there) return refuse(ENOENT);
  if (found->second.descriptor >= 0) return refuse(EBUSY);
  return found->second.descriptor = next_descriptor_++;
}

int ScriptedVideo::close(int descriptor) {
  const std::scoped_lock lock(mutex_);
  Device* device = of(descriptor);
  if (!device) return refuse(EBADF);
  device->descriptor = -1;
  device->streaming = false;
  device->frames.clear();
  return 0;
}

int ScriptedVideo::control(int descriptor, unsigned long request, void* argument) {
  const std::scoped_lock lock(mutex_);
  Device* device = of(descriptor);
  if (!device) return refuse(EBADF);
  if (!device->there) return refuse(ENODEV);
  switch (request) {
    case VIDIOC_QUERYCAP: static_cast<v4l2_capability*>(argument)->capabilities = capabilities; return 0;
    case VIDIOC_S_FMT: {
      auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
      if (other_size) pix.width = 1234;
      const bool wide = pix.pixelformat == V4L2_PIX_FMT_Y10 || pix.pixelformat == V4L2_PIX_FMT_YUYV;
      pix.bytesperline = pix.pixelformat == V4L2_PIX_FMT_MJPEG ? 0 : pix.width * (wide ? 2 : 1);
      pix.sizeimage = pix.width * pix.height * 2;
      device->length = pix.sizeimage;
      return 0;
    }
    case VIDIOC_G_FMT:
      if (keeps_other_size) static_cast<v4l2_format*>(argument)->fmt.pix.width = 1234;
      return 0;
    case VIDIOC_QUERYCTRL:
      static_cast<v4l2_queryctrl*>(argument)->flags = flags[static_cast<v4l2_queryctrl*>(argument)->id];
      return known.contains(static_cast<v4l2_queryctrl*>(argument)->id) ? 0 : refuse(EINVAL);
    case VIDIOC_S_CTRL: return set_control(*static_cast<v4l2_control*>(argument));
    case VIDIOC_G_CTRL: return read_control(*static_cast<v4l2_control*>(argument));
    case VIDIOC_REQBUFS:
      device->buffers.assign(static_cast<v4l2_requestbuffers*>(argument)->count,
                             std::vector<std::uint8_t>(device->length));
      device->queued.clear();
      return 0;
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= device->buffers.size()) return refuse(EINVAL);
      buffer.length = static_cast<std::uint32_t>(device->length);
      buffer.m.offset = buffer.index;
      return 0;
    }
    case VIDIOC_QBUF: device->queued.push_back(static_cast<v4l2_buffer*>(argument)->index); return 0;
    case VIDIOC_DQBUF: return take(*device, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON: device->streaming = true; return 0;
    case VIDIOC_STREAMOFF: device->streaming = false; return 0;
    default: return refuse(ENOTTY);
  }
}

int ScriptedVideo::set_control(const v4l2_control& control) {
  if (!known.contains(control.id)) return refuse(EINVAL);
  if (limit.contains(control.id) && control.value > limit[control.id]) return refuse(ERANGE);
  if ((flags[control.id] & V4L2_CTRL_FLAG_READ_ONLY) != 0) return refuse(EACCES);
  const int each = step.contains(control.id) ? step[control.id] : 1;
  known[control.id] = control.value / each * each;
  if (side_effects.contains(control.id)) known[side_effects[control.id].first] = side_effects[control.id].second;
  return 0;
}

int ScriptedVideo::read_control(v4l2_control& control) {
  if (!known.contains(control.id)) return refuse(EINVAL);
  if ((flags[control.id] & V4L2_CTRL_FLAG_WRITE_ONLY) != 0) return refuse(EACCES);
  control.value = known[control.id];
  return 0;
}

int ScriptedVideo::take(Device& device, v4l2_buffer& buffer) {
  const auto frame = std::ranges::find_if(device.frames, [&](const Frame& each) { return each.due <= clock_.now(); });
  if (frame == device.frames.end() || device.queued.empty()) return refuse(EAGAIN);
  buffer.index = device.queued.front();
  device.queued.pop_front();
  auto& memory = device.buffers[buffer.index];
  buffer.bytesused = static_cast<std::uint32_t>(std::min(frame->bytes.size(), memory.size()));
  std::memcpy(memory.data(), frame->bytes.data(), buffer.bytesused);
  buffer.sequence = frame->sequence;
  buffer.flags = stamps | frame->flags;
  const auto since = frame->stamp.time_since_epoch();
  buffer.timestamp.tv_sec = std::chrono::duration_cast<std::chrono::seconds>(since).count();
  buffer.timestamp.tv_usec =
      std::chrono::duration_cast<std::chrono::microseconds>(since % std::chrono::seconds(1)).count();
  device.frames.erase(frame);
  return 0;
}

void* ScriptedVideo::map(int descriptor, std::size_t, long offset) {
  const std::scoped_lock lock(mutex_);
  Device* device = of(descriptor);
  const auto index = static_cast<std::size_t>(offset);
  if (!device || index >= device->buffers.size()) return MAP_FAILED;
  return device->buffers[index].data();
}

int ScriptedVideo::wait(int descriptor, int timeout_ms) {
  std::unique_lock lock(mutex_);
  Device* device = of(descriptor);
  if (!device) return refuse(EBADF);
  const auto until = clock_.now() + std::chrono::milliseconds(timeout_ms);
  for (;;) {
    if (!device->there || due(*device)) return 1;
    auto wake = until;
    for (const Frame& frame : device->frames) wake = std::min(wake, frame.due);
    const std::size_t waiting = device->frames.size();
    clock_.wait_until(lock, changed_, wake, [&] { return !device->there || device->frames.size() != waiting; });
    if (!due(*device) && device->there && clock_.now() >= until) return 0;
  }
}

}  // namespace scanrig
