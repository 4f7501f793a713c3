#include "drivers/camera/v4l2_sensor.h"

#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace scanrig {
namespace {

constexpr std::uint32_t kVideoBuffers = 4;
constexpr std::chrono::microseconds kExposureUnit{100};  // of V4L2_CID_EXPOSURE_ABSOLUTE

struct Fourcc {
  std::uint32_t code;
  Layout layout;
  int bits;
};

constexpr std::array kFormats{
    Fourcc{V4L2_PIX_FMT_GREY, Layout::mono, 8},         Fourcc{V4L2_PIX_FMT_Y10, Layout::mono, 10},
    Fourcc{V4L2_PIX_FMT_Y12, Layout::mono, 12},         Fourcc{V4L2_PIX_FMT_Y16, Layout::mono, 16},
    Fourcc{V4L2_PIX_FMT_YUYV, Layout::yuyv, 8},         Fourcc{V4L2_PIX_FMT_RGB24, Layout::rgb, 8},
    Fourcc{V4L2_PIX_FMT_BGR24, Layout::bgr, 8},         Fourcc{V4L2_PIX_FMT_SRGGB8, Layout::bayer_rg, 8},
    Fourcc{V4L2_PIX_FMT_SGRBG8, Layout::bayer_gr, 8},   Fourcc{V4L2_PIX_FMT_SGBRG8, Layout::bayer_gb, 8},
    Fourcc{V4L2_PIX_FMT_SBGGR8, Layout::bayer_bg, 8},   Fourcc{V4L2_PIX_FMT_SRGGB10, Layout::bayer_rg, 10},
    Fourcc{V4L2_PIX_FMT_SGRBG10, Layout::bayer_gr, 10}, Fourcc{V4L2_PIX_FMT_SGBRG10, Layout::bayer_gb, 10},
    Fourcc{V4L2_PIX_FMT_SBGGR10, Layout::bayer_bg, 10}, Fourcc{V4L2_PIX_FMT_MJPEG, Layout::jpeg, 8},
};

/// "Y10" means the code "Y10 ".
std::uint32_t code_of(std::string name) {
  name.resize(4, ' ');
  return v4l2_fourcc(name[0], name[1], name[2], name[3]);
}

const Fourcc* find_format(std::uint32_t code) {
  const auto* format = std::ranges::find(kFormats, code, &Fourcc::code);
  return format == kFormats.end() ? nullptr : format;
}

}  // namespace

V4l2Sensor::V4l2Sensor(const std::string& side, const V4l2SensorOptions& sensor, const V4l2Options& options,
                       VideoCalls& calls, Clock& clock)
    : name_(fmt::format("{} camera {}", side, sensor.serial.empty() ? sensor.device : sensor.serial)),
      sensor_(sensor),
      options_(options),
      calls_(calls),
      clock_(clock) {}

tl::unexpected<Error> V4l2Sensor::failed(const std::string& what, int reason) {
  auto code = ErrorCode::io;
  if (reason == ENOENT || reason == ENXIO) code = ErrorCode::not_found;
  if (reason == EINVAL || reason == ERANGE) code = ErrorCode::invalid_input;
  if (code != ErrorCode::invalid_input) lost_ = true;  // reconnected by the next arm()
  return fail(code, "{}: {}: {}", name_, what, std::strerror(reason));
}

Result<void> V4l2Sensor::call(unsigned long request, void* argument, const char* what) {
  if (calls_.control(descriptor_, request, argument) < 0) return failed(what, errno);
  return {};
}

Result<bool> V4l2Sensor::prepare(Deadline deadline) {
  if (descriptor_ >= 0 && !lost_) {
    v4l2_capability capability{};
    std::ignore = call(VIDIOC_QUERYCAP, &capability, "ask whether it is there");  // detects a loss
  }
  if (descriptor_ >= 0 && !lost_) return false;
  disconnect();
  if (deadline.expired(clock_)) return fail(ErrorCode::timeout, "{}: no time left to connect", name_);
  if (auto connected = connect(); !connected) {
    disconnect();
    return pass_on(connected);
  }
  return true;
}

Result<std::string> V4l2Sensor::find_device() const {
  if (sensor_.serial.empty()) return sensor_.device;
  // usb-MAKER_MODEL_SERIAL-video-index0 [udev, 60-persistent-v4l.rules]; index0 delivers images.
  const std::string tail = "_" + sensor_.serial + "-video-index0";
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(options_.by_id, none)) {
    if (entry.path().filename().string().ends_with(tail)) return entry.path().string();
  }
  return fail(ErrorCode::not_found, "{}: no camera with this serial number in {}; check power and cable", name_,
              options_.by_id.string());
}

Result<void> V4l2Sensor::connect() {
  const auto device = find_device();
  if (!device) return pass_on(device);
  descriptor_ = calls_.open(*device);
  if (descriptor_ < 0) return failed("open " + *device, errno);
  lost_ = false;
  v4l2_capability capability{};
  if (auto asked = call(VIDIOC_QUERYCAP, &capability, "ask what it can do"); !asked) return asked;
  const auto can = capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
  if (!(can & V4L2_CAP_VIDEO_CAPTURE) || !(can & V4L2_CAP_STREAMING)) {
    return fail(ErrorCode::unsupported, "{}: {} delivers no stream of images", name_, *device);
  }
  if (auto set = set_format(); !set) return set;
  if (auto set = set_controls(); !set) return set;
  return start();
}

Result<void> V4l2Sensor::set_format() {
  const std::uint32_t code = code_of(options_.pixel_format);
  if (options_.pixel_format.size() > 4 || !find_format(code)) {
    return fail(ErrorCode::unsupported, "{}: pixel format {} cannot be read", name_, options_.pixel_format);
  }
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(options_.size.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(options_.size.height);
  format.fmt.pix.pixelformat = code;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  const v4l2_pix_format wanted = format.fmt.pix;
  if (auto set = call(VIDIOC_S_FMT, &format, "set the image format"); !set) return set;
  // The driver may reply with other values, or keep others.
  if (auto read = call(VIDIOC_G_FMT, &format, "read the image format"); !read) return read;
  format_ = format.fmt.pix;
  if (format_.pixelformat != code || format_.width != wanted.width || format_.height != wanted.height) {
    return fail(ErrorCode::unsupported, "{}: asked for {} of {}x{} it delivers {}x{} or another format", name_,
                options_.pixel_format, wanted.width, wanted.height, format_.width, format_.height);
  }
  return {};
}

/// Controls in the order in which they are set: a value that an automatic has cannot be set.
std::vector<V4l2Sensor::Wanted> V4l2Sensor::wanted_controls() const {
  const auto exposure = static_cast<int>(std::max<long>(1, options_.exposure.count() / kExposureUnit.count()));
  const int coarse = std::max(1, exposure / 20);  // devices round to lines of the sensor
  std::vector<Wanted> all{{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "manual exposure"},
                          {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "a constant frame rate"},
                          {V4L2_CID_AUTOGAIN, 0, "a constant gain"},
                          {V4L2_CID_AUTO_WHITE_BALANCE, 0, "a constant white balance"},
                          {V4L2_CID_FOCUS_AUTO, 0, "a fixed focus"},
                          {V4L2_CID_EXPOSURE_ABSOLUTE, exposure, "an exposure in units of 100 us", coarse}};
  if (options_.gain) all.push_back({V4L2_CID_GAIN, *options_.gain, "a gain", 0, true});
  for (const auto& [id, value] : options_.controls) all.push_back({id, value, "", 0, true});
  for (Wanted& wanted : all) {
    if (wanted.what.empty()) wanted.what = fmt::format("control 0x{:08X}", wanted.id);
  }
  return all;
}

/// They are read back when all are set: a maker's trigger mode may change an exposure.
Result<void> V4l2Sensor::set_controls() {
  std::vector<Wanted> readable;
  for (const Wanted& wanted : wanted_controls()) {
    const auto may_read = set_control(wanted);
    if (!may_read) return pass_on(may_read);
    if (*may_read) readable.push_back(wanted);
  }
  for (const Wanted& wanted : readable) {
    if (auto kept = check_control(wanted); !kept) return kept;
  }
  return {};
}

/// Returns whether the control can be read.
Result<bool> V4l2Sensor::set_control(const Wanted& wanted) {
  v4l2_queryctrl asked{};
  asked.id = wanted.id;
  if (calls_.control(descriptor_, VIDIOC_QUERYCTRL, &asked) < 0) {
    if (errno != EINVAL) return failed(fmt::format("ask for control 0x{:08X}", wanted.id), errno);
    if (!wanted.must_exist) return false;
    return fail(ErrorCode::invalid_input, "{}: there is no control 0x{:08X}", name_, wanted.id);
  }
  v4l2_control control{wanted.id, wanted.value};
  const std::string what = fmt::format("set control 0x{:08X} to {}", wanted.id, wanted.value);
  const bool is_fixed = (asked.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;  // read back, it may have the value
  if (!is_fixed) {
    if (auto set = call(VIDIOC_S_CTRL, &control, what.c_str()); !set) return pass_on(set);
  }
  return (asked.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0 && asked.type != V4L2_CTRL_TYPE_BUTTON;
}

Result<void> V4l2Sensor::check_control(const Wanted& wanted) {
  v4l2_control control{wanted.id, 0};
  const std::string what = fmt::format("read control 0x{:08X}", wanted.id);
  if (auto read = call(VIDIOC_G_CTRL, &control, what.c_str()); !read) return read;
  if (std::abs(control.value - wanted.value) <= wanted.tolerance) return {};
  return fail(ErrorCode::invalid_input, "{}: asked for {} ({}) it has {}; choose a value that v4l2-ctl -L shows", name_,
              wanted.what, wanted.value, control.value);
}

Result<void> V4l2Sensor::start() {
  v4l2_requestbuffers request{};
  request.count = kVideoBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (auto asked = call(VIDIOC_REQBUFS, &request, "ask for buffers"); !asked) return asked;
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (auto asked = call(VIDIOC_QUERYBUF, &buffer, "ask for a buffer"); !asked) return asked;
    void* address = calls_.map(descriptor_, buffer.length, buffer.m.offset);
    if (address == MAP_FAILED) return failed("map a buffer", errno);
    buffers_.push_back({address, buffer.length});
    if (auto queued = call(VIDIOC_QBUF, &buffer, "queue a buffer"); !queued) return queued;
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return call(VIDIOC_STREAMON, &type, "start the stream");
}

void V4l2Sensor::disconnect() {
  if (descriptor_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  calls_.control(descriptor_, VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) calls_.unmap(buffer.address, buffer.length);
  buffers_.clear();
  calls_.close(descriptor_);
  descriptor_ = -1;
}

Result<std::optional<SensorFrame>> V4l2Sensor::next(Deadline deadline) {
  if (descriptor_ < 0) return fail(ErrorCode::io, "{}: not connected", name_);
  for (;;) {
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(deadline.left(clock_)).count();
    const int ready = calls_.wait(descriptor_, static_cast<int>(std::min<long>(wait, 60'000)));
    if (ready < 0 && errno != EINTR) return pass_on(Result<void>(failed("wait for a frame", errno)));
    if (ready > 0) break;
    if (deadline.expired(clock_)) return std::nullopt;
  }
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (calls_.control(descriptor_, VIDIOC_DQBUF, &buffer) < 0) {
    if (errno == EAGAIN) return std::nullopt;
    return pass_on(Result<void>(failed("take a frame", errno)));
  }
  auto frame = read(buffer);
  if (auto queued = call(VIDIOC_QBUF, &buffer, "give a buffer back"); !queued) return pass_on(queued);
  if (!frame) return pass_on(frame);
  return std::optional(std::move(*frame));
}

Result<SensorFrame> V4l2Sensor::read(const v4l2_buffer& buffer) const {
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    return fail(ErrorCode::unsupported, "{}: frames are not stamped with the monotonic clock", name_);
  }
  if (buffer.index >= buffers_.size() || buffer.bytesused > buffers_[buffer.index].length) {
    return fail(ErrorCode::io, "{}: the driver names a buffer that is none", name_);
  }
  SensorFrame frame;
  frame.arrival = clock_.now();
  frame.stamp.id = buffer.sequence;
  frame.stamp.time =
      std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
  const bool at_begin = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (!at_begin) frame.stamp.time -= options_.exposure;
  if (buffer.flags & V4L2_BUF_FLAG_ERROR) {
    frame.damage = "the driver marks it as damaged";
    return frame;
  }
  const Fourcc* format = find_format(format_.pixelformat);
  RawImage raw;
  raw.layout = format->layout;
  raw.bits = format->bits;
  raw.size = options_.size;
  raw.stride = format_.bytesperline;
  raw.bytes = {static_cast<const std::uint8_t*>(buffers_[buffer.index].address), buffer.bytesused};
  auto decoded = decode_image(raw);
  if (decoded) {
    frame.decoded = std::move(*decoded);
  } else {
    frame.damage = decoded.error().message;
  }
  return frame;
}

Result<bool> V4l2Sensor::listen_to_line(bool) {
  return fail(ErrorCode::unsupported, "{}: V4L2 has no trigger to choose", name_);
}

Result<void> V4l2Sensor::scale_exposure(double factor, Deadline) {
  options_.exposure = scaled_exposure(configured_exposure_, factor);
  if (descriptor_ < 0 || lost_) return {};  // set when it is connected
  for (const Wanted& wanted : wanted_controls()) {
    if (wanted.id != V4L2_CID_EXPOSURE_ABSOLUTE) continue;
    const auto may_read = set_control(wanted);
    if (!may_read) return pass_on(may_read);
    if (*may_read) return check_control(wanted);
  }
  return {};
}

Result<void> V4l2Sensor::trigger() { return fail(ErrorCode::unsupported, "{}: V4L2 has no software trigger", name_); }

std::unique_ptr<SensorCamera> v4l2_camera(const V4l2Options& options, VideoCalls& calls, Clock& clock) {
  std::vector<std::unique_ptr<Sensor>> sensors;
  sensors.push_back(
      std::make_unique<V4l2Sensor>(options.right ? "left" : "stereo", options.left, options, calls, clock));
  if (options.right) {
    sensors.push_back(std::make_unique<V4l2Sensor>("right", *options.right, options, calls, clock));
  }
  TriggeringOptions triggering;
  triggering.by = options.external_trigger ? TriggeringOptions::By::line : TriggeringOptions::By::free_run;
  triggering.frame_timeout = options.frame_timeout;
  return std::make_unique<SensorCamera>(std::move(sensors), triggering, clock);
}

Result<std::unique_ptr<SensorCamera>> open_v4l2(const V4l2Options& options, VideoCalls& calls, Clock& clock,
                                                Deadline deadline) {
  auto camera = v4l2_camera(options, calls, clock);
  if (auto ready = camera->prepare(deadline); !ready) return pass_on(ready);
  return camera;
}

}  // namespace scanrig
