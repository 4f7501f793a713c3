#include "sim/wire/gige_sensor.h"

#include <arpa/inet.h>
#include <arv.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

namespace scanrig::sim::wire {
namespace {

/// The packet delay of a GigE Vision camera, ns. Where a description has none, Aravis allows 1 us at most.
constexpr const char* kPacketDelay =
    R"(<Integer Name="GevSCPD"><pValue>GevSCPDReg</pValue><Min>0</Min><Max>1000000000</Max></Integer>
<IntReg Name="GevSCPDReg"><Address>0xd08</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
)";

/// Makes the camera take at most `longest`, without an error for a longer request.
void limit_exposure(std::string& description, std::chrono::microseconds longest) {
  const std::string formula = "<FormulaTo>FROM</FormulaTo>";
  const auto converter = description.find("Name=\"ExposureTimeAbsConverter\"");
  const auto at = description.find(formula, converter);
  if (longest.count() == 0 || converter == std::string::npos || at == std::string::npos) return;
  const std::string us = std::to_string(longest.count());
  description.replace(at, formula.size(), "<FormulaTo>(FROM &gt; " + us + ") ? " + us + " : FROM</FormulaTo>");
}

/// Aravis' own description, with a packet delay and outputs, with Line0 standing for the software trigger, and with
/// `selector` for FrameStart.
std::string genicam_description(const GigeSensorOptions& options) {
  const std::string& selector = options.trigger_selector;
  ArvFakeCamera* sample = arv_fake_camera_new("sample");
  std::size_t size = 0;
  const char* bytes = arv_fake_camera_get_genicam_xml(sample, &size);
  std::string text(bytes, size);
  g_object_unref(sample);
  const std::size_t line = text.find("Name=\"Line0\"");
  const std::size_t value = text.find("<Value>0</Value>", line);
  if (line != std::string::npos && value != std::string::npos) text.replace(value, 16, "<Value>1</Value>");
  const std::string frame_start = "Name=\"FrameStart\"";
  if (const auto name = text.find(frame_start); name != std::string::npos) {
    text.replace(name, frame_start.size(), "Name=\"" + selector + "\"");
  }
  if (const auto end = text.rfind("</RegisterDescription>"); end != std::string::npos)
    text.insert(end, kPacketDelay + describe_outputs(options.outputs));
  limit_exposure(text, options.max_exposure);
  return text;
}

/// Mean over 5x5 pixels, fewer at the rim.
void blur(cv::Mat& image) {
  constexpr int kReach = 2;
  const cv::Mat sharp = image.clone();
  const cv::Rect whole(0, 0, image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const cv::Rect around(x - kReach, y - kReach, 2 * kReach + 1, 2 * kReach + 1);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(cv::mean(sharp(around & whole))[0]);
    }
  }
}

/// A socket for nudge(), or -1.
int socket_to(const std::string& address) {
  sockaddr_in camera{};
  camera.sin_family = AF_INET;
  camera.sin_port = htons(3956);
  ::inet_pton(AF_INET, address.c_str(), &camera.sin_addr);
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  std::ignore = ::connect(descriptor, reinterpret_cast<const sockaddr*>(&camera), sizeof camera);
  return descriptor;
}

/// Polling interval of Aravis' camera for its trigger register; before it, the camera waits for a millisecond with all
/// of a processor's time.
constexpr double kLooksPerSecond = 250.0;

/// Sometimes it polls only after 100 ms or the next packet: a discovery request [GigE Vision 1.2, 14.1] is one.
void nudge(int descriptor) {
  constexpr std::array<std::uint8_t, 8> kDiscovery{0x42, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01};
  std::array<std::uint8_t, 512> reply;
  while (::recv(descriptor, reply.data(), reply.size(), 0) > 0) {
  }
  std::ignore = ::send(descriptor, kDiscovery.data(), kDiscovery.size(), 0);
}

std::uint16_t id_after(std::uint16_t id) { return id == 65535 ? 1 : static_cast<std::uint16_t>(id + 1); }

}  // namespace

Result<std::unique_ptr<GigeSensor>> GigeSensor::start(const GigeSensorOptions& options, FrameSource source,
                                                      Clock& clock) {
  std::string file = (std::filesystem::temp_directory_path() / "scanrig-genicam-XXXXXX").string();
  const int descriptor = ::mkstemp(file.data());
  if (descriptor < 0) return fail(ErrorCode::io, "no temporary file {}", file);
  ::close(descriptor);
  std::ofstream(file) << genicam_description(options);
  std::unique_ptr<GigeSensor> sensor(new GigeSensor(options, std::move(source), clock, file));
  if (auto plugged = sensor->plug(true); !plugged) return pass_on(plugged);
  return sensor;
}

GigeSensor::GigeSensor(const GigeSensorOptions& options, FrameSource source, Clock& clock, std::string description)
    : options_(options),
      source_(std::move(source)),
      clock_(clock),
      description_(std::move(description)),
      started_(clock.now()),
      nudge_socket_(socket_to(options.address)),
      sender_([this](const std::stop_token& stop) { send_frames(stop); }) {}

GigeSensor::~GigeSensor() {
  sender_.request_stop();
  changed_.notify_all();
  sender_.join();
  std::ignore = plug(false);
  ::close(nudge_socket_);
  std::error_code ignored;
  std::filesystem::remove(description_, ignored);
}

Result<void> GigeSensor::plug(bool in) {
  if (!in) {
    std::unique_lock lock(mutex_);
    ArvGvFakeCamera* camera = std::exchange(camera_, nullptr);
    core_ = nullptr;
    queue_.clear();
    triggered_.reset();
    lock.unlock();
    if (camera) g_object_unref(camera);  // joins the camera's thread, which may be in fill()
    return {};
  }
  ArvGvFakeCamera* camera =
      arv_gv_fake_camera_new_full(options_.address.c_str(), options_.serial.c_str(), description_.c_str());
  if (!camera || !arv_gv_fake_camera_is_running(camera)) {
    if (camera) g_object_unref(camera);
    return fail(ErrorCode::io, "GigE camera on {}: the address or its port cannot be used", options_.address);
  }
  ArvFakeCamera* core = arv_gv_fake_camera_get_fake_camera(camera);
  const auto width = static_cast<std::uint32_t>(options_.size.width);
  const auto height = static_cast<std::uint32_t>(options_.size.height);
  arv_fake_camera_write_register(core, ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, width);
  arv_fake_camera_write_register(core, ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, height);
  arv_fake_camera_write_register(core, ARV_FAKE_CAMERA_REGISTER_WIDTH, width);
  arv_fake_camera_write_register(core, ARV_FAKE_CAMERA_REGISTER_HEIGHT, height);
  arv_fake_camera_set_trigger_frequency(core, kLooksPerSecond);
  arv_fake_camera_set_fill_pattern(core, &GigeSensor::fill, this);
  const std::scoped_lock lock(mutex_);
  camera_ = camera;
  core_ = core;
  return {};
}

void GigeSensor::set_clock(std::chrono::nanoseconds by) {
  const std::scoped_lock lock(mutex_);
  set_by_ += by;
}

/// Call with `mutex_` held.
bool GigeSensor::streaming() const { return core_ && arv_fake_camera_get_acquisition_status(core_) != 0; }

/// Call with `mutex_` held.
GigeSensor::Frame GigeSensor::new_frame(const GigeExposure& exposure) {
  last_id_ = id_after(last_id_);
  const double since = static_cast<double>((exposure.at - started_).count());
  const auto drifted = std::chrono::nanoseconds(static_cast<std::int64_t>(since * (1.0 + options_.clock_drift)));
  constexpr auto kBegin = std::chrono::hours(10);
  return {last_id_, kBegin + options_.clock_ahead + set_by_ + drifted, exposure, GigeFault::none, exposure.at};
}

void GigeSensor::expose(const GigeExposure& exposure, GigeFault fault) {
  const std::scoped_lock lock(mutex_);
  if (!streaming() || fault == GigeFault::missed) return;
  Frame frame = new_frame(exposure);
  frame.fault = fault;
  frame.due += options_.frame_after;
  if (fault == GigeFault::late) frame.due += options_.late_by;
  if (fault == GigeFault::stale && last_) {
    const auto id = frame.id;  // ids are given when sent
    frame = *last_;
    frame.id = id;
    frame.due = exposure.at;
  } else {
    last_ = frame;
    last_->fault = GigeFault::none;
  }
  if (fault == GigeFault::lost) return;
  queue_.push_back(frame);
  clock_.notify_all(changed_);
}

/// Writes the trigger register for one frame after the other, each when it is due and the one before has been filled.
void GigeSensor::send_frames(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const auto now = clock_.now();
    if (!streaming()) {  // a camera that is not acquiring drops its edges
      queue_.clear();
      triggered_.reset();
      if (core_) arv_fake_camera_write_register(core_, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 0);
    }
    const auto first = std::ranges::min_element(queue_, {}, &Frame::due);
    const bool due = first != queue_.end() && first->due <= now && !triggered_;
    const bool developing = due && options_.ready && !options_.ready(first->exposure);
    if (due && !developing) {
      triggered_ = *first;
      queue_.erase(first);
      arv_fake_camera_write_register(core_, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 1);
    }
    if (triggered_) nudge(nudge_socket_);
    auto wake = now + std::chrono::milliseconds(triggered_ || developing ? 2 : 100);
    if (!triggered_ && !developing) {
      for (const Frame& frame : queue_) wake = std::min(wake, frame.due);
    }
    const std::size_t waiting = queue_.size();
    const bool busy = triggered_.has_value();
    clock_.wait_until(lock, changed_, wake, [&] {
      return stop.stop_requested() || queue_.size() != waiting || triggered_.has_value() != busy;
    });
  }
}

void GigeSensor::fill(ArvBuffer* buffer, void* self, std::uint32_t, std::uint32_t, std::uint32_t) {
  static_cast<GigeSensor*>(self)->fill(buffer);
}

/// Called from the camera's thread, once per frame, before its packets are sent. Without an edge it was the host's own
/// trigger.
void GigeSensor::fill(ArvBuffer* buffer) {
  std::unique_lock lock(mutex_);
  auto triggered = std::exchange(triggered_, std::nullopt);
  ArvGvFakeCamera* const camera = camera_;
  clock_.notify_all(changed_);
  lock.unlock();
  const Frame frame = triggered ? *triggered : exposed_by_host();
  constexpr double kTornShare = 0.5;
  if (camera) g_object_set(camera, "gvsp-lost-ratio", frame.fault == GigeFault::torn ? kTornShare : 0.0, nullptr);
  arv_buffer_set_frame_id(buffer, frame.id);
  arv_buffer_set_timestamp(buffer, static_cast<std::uint64_t>(frame.stamp.count()));
  std::size_t received = 0;
  auto* bytes = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &received)));
  const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
  const std::size_t pixel = ARV_PIXEL_FORMAT_BIT_PER_PIXEL(arv_buffer_get_image_pixel_format(buffer)) / 8;
  cv::Mat grey(height, width, CV_8U, bytes);
  if (pixel > 1) grey = cv::Mat(height, width, CV_8U);
  draw(frame, grey);
  if (pixel == 1) return;
  // Wider pixels: the grey value in the last byte of each, which of Mono16 is the upper one.
  for (std::size_t i = 0; i < grey.total(); ++i) {
    for (std::size_t k = 0; k < pixel; ++k) bytes[i * pixel + k] = grey.data[i];
  }
}

GigeSensor::Frame GigeSensor::exposed_by_host() {
  const auto active = output();
  std::unique_lock lock(mutex_);
  Strobe strobe{{kFirstBySoftware + ++by_software_, false, clock_.now()}};
  const auto show = on_strobe_;
  lock.unlock();
  if (active && show) strobe = show(*active);  // without the lock: it takes the other camera's
  lock.lock();
  Frame frame = new_frame(strobe.exposure);
  frame.fault = strobe.fault;
  last_ = frame;
  last_->fault = GigeFault::none;
  return frame;
}

void GigeSensor::on_strobe(std::function<Strobe(int output)> act) {
  const std::scoped_lock lock(mutex_);
  on_strobe_ = std::move(act);
}

std::optional<int> GigeSensor::output() const {
  const std::scoped_lock lock(mutex_);
  return core_ ? output_while_exposing(core_) : std::nullopt;
}

std::chrono::microseconds GigeSensor::exposure_time() const {
  const std::scoped_lock lock(mutex_);
  std::uint32_t us = 0;
  if (core_) arv_fake_camera_read_register(core_, ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US, &us);
  return std::chrono::microseconds(us);
}

void GigeSensor::draw(const Frame& frame, cv::Mat& image) const {
  Side side = options_.side;
  if (frame.fault == GigeFault::swapped) side = side == Side::left ? Side::right : Side::left;
  source_(side, frame.exposure, image);
  if (frame.fault == GigeFault::dark) image.setTo(3);
  if (frame.fault == GigeFault::blurred) {
    for (int pass = 0; pass < 2; ++pass) blur(image);
  }
  if (options_.numbered) hide_number(static_cast<std::uint32_t>(frame.exposure.number), image);
}

}  // namespace scanrig::sim::wire
