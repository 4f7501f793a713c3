#include "drivers/camera/aravis_sensor.h"

#include <algorithm>
#include <array>
#include <thread>

#include "drivers/camera/aravis_setup.h"
#include "drivers/camera/aravis_strobe.h"

namespace scanrig {
namespace {

constexpr std::uint64_t kGigeIds = 65535;  // 1 to 65535: 0 is skipped [GigE Vision 1.2, 24.3]

struct Pfnc {
  ArvPixelFormat format;
  Layout layout;
  int bits;
};

// Names and codes of the Pixel Format Naming Convention; 10 and 12 bits unpacked, in 16-bit words.
constexpr std::array kFormats{
    Pfnc{ARV_PIXEL_FORMAT_MONO_8, Layout::mono, 8},
    Pfnc{ARV_PIXEL_FORMAT_MONO_10, Layout::mono, 10},
    Pfnc{ARV_PIXEL_FORMAT_MONO_12, Layout::mono, 12},
    Pfnc{ARV_PIXEL_FORMAT_MONO_14, Layout::mono, 14},
    Pfnc{ARV_PIXEL_FORMAT_MONO_16, Layout::mono, 16},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_RG_8, Layout::bayer_rg, 8},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_RG_10, Layout::bayer_rg, 10},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_RG_12, Layout::bayer_rg, 12},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_RG_16, Layout::bayer_rg, 16},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GR_8, Layout::bayer_gr, 8},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GR_10, Layout::bayer_gr, 10},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GR_12, Layout::bayer_gr, 12},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GR_16, Layout::bayer_gr, 16},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GB_8, Layout::bayer_gb, 8},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GB_10, Layout::bayer_gb, 10},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GB_12, Layout::bayer_gb, 12},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_GB_16, Layout::bayer_gb, 16},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_BG_8, Layout::bayer_bg, 8},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_BG_10, Layout::bayer_bg, 10},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_BG_12, Layout::bayer_bg, 12},
    Pfnc{ARV_PIXEL_FORMAT_BAYER_BG_16, Layout::bayer_bg, 16},
    Pfnc{ARV_PIXEL_FORMAT_RGB_8_PACKED, Layout::rgb, 8},
    Pfnc{ARV_PIXEL_FORMAT_BGR_8_PACKED, Layout::bgr, 8},
    Pfnc{ARV_PIXEL_FORMAT_YUV_422_YUYV_PACKED, Layout::yuyv, 8},
};

const char* in_words(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_SUCCESS: return "";
    case ARV_BUFFER_STATUS_TIMEOUT: return "packets did not come in time";
    case ARV_BUFFER_STATUS_MISSING_PACKETS: return "packets are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID: return "packets out of order";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH: return "not of the size that was set";
    case ARV_BUFFER_STATUS_ABORTED: return "given up by the camera";
    default: return "not filled";
  }
}

using Lost = std::shared_ptr<std::atomic<bool>>;

/// By exchange: a thread that reads the flag after several marks sees everything done before each of them.
void mark(const Lost& lost) { lost->exchange(true); }

void on_control_lost(ArvDevice*, gpointer lost) { mark(*static_cast<Lost*>(lost)); }

void forget(gpointer lost, GClosure*) {
  const std::unique_ptr<Lost> last(static_cast<Lost*>(lost));
  std::ignore = (*last)->load();  // the signal's thread finishes with it before this point
}

/// The library tells a loss on the device's own heartbeat thread, which holds a reference meanwhile. Were that the last
/// one, the thread would free the device and wait for itself, which ends the program.
void free_by_this_thread(GRef<ArvDevice> device) {
  constexpr int kTries = 1000;
  constexpr gulong kTryUs = 1000;
  g_signal_handlers_disconnect_matched(device.get(), G_SIGNAL_MATCH_FUNC, 0, 0, nullptr,
                                       reinterpret_cast<gpointer>(&on_control_lost), nullptr);
  for (int i = 0; i < kTries && g_atomic_int_get(&G_OBJECT(device.get())->ref_count) > 1; ++i) g_usleep(kTryUs);
}

/// The name of the device with this serial number, or nothing.
std::optional<std::string> find_by_serial(const std::string& serial) {
  arv_update_device_list();
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const char* found = arv_get_device_serial_nbr(i);
    if (found && serial == found) return std::string(arv_get_device_id(i));
  }
  return std::nullopt;
}

Result<void> trigger_by_software(ArvCamera* camera, const GenicamCall& attempt) {
  return attempt("trigger", [&](GError** error) { arv_camera_execute_command(camera, "TriggerSoftware", error); });
}

}  // namespace

AravisSensor::AravisSensor(const std::string& side, const AravisSensorOptions& sensor, const AravisOptions& options,
                           Clock& clock)
    : sensor_(sensor), options_(options), clock_(clock), attempt_(fmt::format("{} camera {}", side, sensor.serial)) {}

AravisSensor::~AravisSensor() {
  if (!*lost_) stop_stream();
  std::ignore = let_go({clock_.now()});
  // No caller waits longer for a lost device: the thread owns everything it needs.
  constexpr auto kLastWait = std::chrono::seconds(3);
  if (giving_up_.valid()) giving_up_.wait_for(kLastWait);
}

std::uint64_t AravisSensor::id_ring() const { return camera_ && arv_camera_is_uv_device(camera_.get()) ? 0 : kGigeIds; }

Result<bool> AravisSensor::prepare(Deadline deadline) {
  if (camera_ && !*lost_) ask_whether_there();
  if (camera_ && !*lost_) return false;
  if (auto free = let_go(deadline); !free) return pass_on(free);
  if (auto ended = wait_for_pending(deadline); !ended) return pass_on(ended);
  if (deadline.expired(clock_)) return fail(ErrorCode::timeout, "{}: no time left to connect", name());
  auto connected = connect(deadline);
  if (connected) connected = start_stream();
  if (connected) return true;
  mark(lost_);
  std::ignore = let_go({clock_.now()});  // if it would have to wait, the next call does it
  return pass_on(connected);
}

/// A request that was not waited for would change the camera after it has been set up anew. If the camera has replied
/// after all, the old connection is closed first: its closing would take the camera away from the new one.
/// Fails with `timeout`.
Result<void> AravisSensor::wait_for_pending(Deadline deadline) {
  if (!pending_.valid()) return {};
  const auto ends = [&](auto& future) {
    return !future.valid() || future.wait_for(deadline.left(clock_)) == std::future_status::ready;
  };
  if (!ends(pending_) || (pending_.get() && !ends(giving_up_))) {
    return fail(ErrorCode::timeout, "{}: lost, and its last request has not ended; try again in 10 s", name());
  }
  pending_ = {};
  return {};
}

/// The library's own heartbeat takes many seconds to detect a lost camera.
void AravisSensor::ask_whether_there() {
  constexpr auto kSilence = std::chrono::seconds(3);  // longer than a move: a healthy scan sends no check
  constexpr guint64 kVersion = 0;  // a register every GigE Vision and USB3 Vision device has [GigE Vision 1.2, 28]
  if (!in_doubt_ && clock_.now() - heard_ < kSilence) return;
  const auto asked = attempt_("ask whether it is there", [&](GError** error) {
    guint32 value = 0;
    arv_device_read_register(arv_camera_get_device(camera_.get()), kVersion, &value, error);
  });
  in_doubt_ = false;
  if (asked) heard_ = clock_.now();
  if (!asked) mark(lost_);
}

Result<void> AravisSensor::connect(Deadline deadline) {
  std::string device = sensor_.address;
  if (device.empty()) {
    const auto found = find_by_serial(sensor_.serial);
    if (!found) {
      return fail(ErrorCode::not_found, "{}: no camera with this serial number; check power, cable and network",
                  name());
    }
    device = *found;
  }
  // A flag for each connection. The signal owns it too, since it may come after the sensor is gone. The flag exists
  // before the threads that the library starts for the connection and that raise the signal.
  lost_ = std::make_shared<std::atomic<bool>>(false);
  auto flag = std::make_unique<Lost>(lost_);
  const auto opened =
      attempt_("connect to " + device, [&](GError** error) { camera_.reset(arv_camera_new(device.c_str(), error)); });
  if (!opened) return opened;
  arv_camera_set_range_check_policy(camera_.get(), ARV_RANGE_CHECK_POLICY_ENABLE);
  g_signal_connect_data(arv_camera_get_device(camera_.get()), "control-lost", G_CALLBACK(on_control_lost),
                        flag.release(), forget, GConnectFlags{});
  std::string serial;
  const auto asked = attempt_("read the serial number", [&](GError** error) {
    if (const char* text = arv_camera_get_device_serial_number(camera_.get(), error)) serial = text;
  });
  if (!asked) return asked;
  if (serial != sensor_.serial) {
    return fail(ErrorCode::invalid_input,
                "{}: the camera at {} has the serial number {}; correct the address or the serial", name(), device,
                serial);
  }
  return set_up(camera_.get(), options_, sensor_.address, clock_, deadline, attempt_);
}

Result<void> AravisSensor::start_stream() {
  const auto created = attempt_("open the stream", [&](GError** error) {
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, error));
  });
  if (!created) return created;
  guint payload = 0;
  const auto asked =
      attempt_("read PayloadSize", [&](GError** error) { payload = arv_camera_get_payload(camera_.get(), error); });
  if (!asked) return asked;
  if (ARV_IS_GV_STREAM(stream_.get())) {
    // A frame with missing packets is given up early enough to be distinguished from one that never came.
    const auto retention = std::chrono::microseconds(options_.frame_timeout) / 2;
    g_object_set(stream_.get(), "frame-retention", static_cast<guint>(retention.count()), "packet-timeout",
                 static_cast<guint>(retention.count() / 5), nullptr);
    // A whole frame, with the kernel's overhead, may wait until this process gets the processor.
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 static_cast<gint>(2 * payload), nullptr);
  }
  finding_ = host_finding(ARV_IS_GV_STREAM(stream_.get()) ? CameraBus::gige : CameraBus::usb3, payload);
  for (int i = 0; i < kBuffers; ++i) arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
  listens_to_line_ = false;
  return start_acquisition();
}

Result<void> AravisSensor::start_acquisition() {
  heard_ = clock_.now();
  return attempt_("start the acquisition", [&](GError** error) { arv_camera_start_acquisition(camera_.get(), error); });
}

void AravisSensor::stop_stream() {
  if (!camera_ || !stream_) return;
  std::ignore = attempt_("stop", [&](GError** error) { arv_camera_stop_acquisition(camera_.get(), error); });
}

/// The library takes some ten seconds to give up a device that does not reply: done on its own thread, one at a time.
/// Fails with `timeout` while the previous device is still being given up.
Result<void> AravisSensor::let_go(Deadline deadline) {
  if (!camera_) return {};
  if (giving_up_.valid() && giving_up_.wait_for(deadline.left(clock_)) != std::future_status::ready) {
    return fail(ErrorCode::timeout, "{}: lost twice, the first connection is still being given up; try again in 10 s",
                name());
  }
  std::promise<void> gone;
  giving_up_ = gone.get_future();
  std::thread([camera = std::move(camera_), stream = std::move(stream_), pending = pending_,
               gone = std::move(gone)]() mutable {
    // A camera that has replied after all is stopped: an exposure still to come is cancelled.
    if (pending.valid() && pending.get()) arv_camera_stop_acquisition(camera.get(), nullptr);
    GRef<ArvDevice> device(ARV_DEVICE(g_object_ref(arv_camera_get_device(camera.get()))));
    stream.reset();
    camera.reset();
    free_by_this_thread(std::move(device));
    gone.set_value();
  }).detach();
  return {};
}

Result<std::optional<SensorFrame>> AravisSensor::next(Deadline deadline) {
  if (!stream_) return fail(ErrorCode::io, "{}: not connected", name());
  const auto wait = std::chrono::ceil<std::chrono::microseconds>(deadline.left(clock_));
  ArvBuffer* buffer = wait.count() > 0
                          ? arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(wait.count()))
                          : arv_stream_try_pop_buffer(stream_.get());
  if (!buffer) {
    if (*lost_) return fail(ErrorCode::io, "{}: the connection is lost; check power and cable", name());
    in_doubt_ = in_doubt_ || wait.count() > 0;
    return std::nullopt;
  }
  auto frame = read(buffer);
  heard_ = clock_.now();
  arv_stream_push_buffer(stream_.get(), buffer);
  if (!frame) return pass_on(frame);
  return std::optional(std::move(*frame));
}

Result<SensorFrame> AravisSensor::read(ArvBuffer* buffer) const {
  SensorFrame frame;
  frame.arrival = clock_.now();
  frame.stamp.id = arv_buffer_get_frame_id(buffer);
  frame.stamp.time = std::chrono::nanoseconds(arv_buffer_get_timestamp(buffer));
  frame.damage = in_words(arv_buffer_get_status(buffer));
  if (!frame.damage.empty()) {
    if (finding_) frame.damage += "; " + *finding_;
    return frame;
  }
  const ArvPixelFormat code = arv_buffer_get_image_pixel_format(buffer);
  const auto* format = std::ranges::find(kFormats, code, &Pfnc::format);
  if (format == kFormats.end()) {
    return fail(ErrorCode::unsupported, "{}: pixel format 0x{:08X} cannot be read", name(), code);
  }
  std::size_t size = 0;
  const void* bytes = arv_buffer_get_image_data(buffer, &size);
  RawImage raw;
  raw.layout = format->layout;
  raw.bits = format->bits;
  raw.size = {arv_buffer_get_image_width(buffer), arv_buffer_get_image_height(buffer)};
  raw.bytes = {static_cast<const std::uint8_t*>(bytes), size};
  auto decoded = decode_image(raw);
  if (decoded) {
    frame.decoded = std::move(*decoded);
  } else {
    frame.damage = decoded.error().message;
  }
  return frame;
}

Result<bool> AravisSensor::listen_to_line(bool line) {
  const bool wanted = line && options_.trigger_source != "Software";
  if (wanted == listens_to_line_) return false;
  if (auto switched = switch_source(wanted ? options_.trigger_source : "Software"); !switched) {
    mark(lost_);  // a device that does not reply is connected again
    return pass_on(switched);
  }
  listens_to_line_ = wanted;
  return true;
}

/// The camera does not acquire meanwhile: many reject another source then. Frames that were on their way are dropped.
Result<void> AravisSensor::switch_source(const std::string& source) {
  auto stopped =
      attempt_("stop the acquisition", [&](GError** error) { arv_camera_stop_acquisition(camera_.get(), error); });
  if (!stopped) return stopped;
  // Ids may restart, and the library's thread would take the first of them for old ones.
  arv_stream_stop_thread(stream_.get(), FALSE);
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_.get())) arv_stream_push_buffer(stream_.get(), buffer);
  arv_stream_start_thread(stream_.get());
  if (auto set = set_trigger_source(camera_.get(), source, attempt_); !set) return set;
  return start_acquisition();
}

Result<void> AravisSensor::trigger() {
  auto triggered = trigger_by_software(camera_.get(), attempt_);
  if (!triggered) mark(lost_);
  return triggered;
}

Result<void> AravisSensor::scale_exposure(double factor, Deadline deadline) {
  const auto exposure = scaled_exposure(configured_exposure_, factor);
  options_.exposure = exposure;  // for a camera that has to be connected
  if (!camera_ || *lost_) return {};
  return request(
      "change its exposure",
      [exposure, attempt = attempt_](ArvCamera* camera) { return set_exposure(camera, exposure, attempt); }, deadline);
}

/// The library repeats a request without reply for seconds: done on a thread that the caller does not wait for beyond
/// `deadline`. The thread has the camera to itself until then, and the camera is given up after.
Result<void> AravisSensor::request(const char* what, Act act, Deadline deadline) {
  if (!camera_ || *lost_) {
    return fail(ErrorCode::io, "{}: cannot {}, it is not connected; check power and cable", name(), what);
  }
  GRef<ArvCamera> camera(ARV_CAMERA(g_object_ref(camera_.get())));
  std::packaged_task<Result<void>()> task([camera = std::move(camera), act = std::move(act)]() mutable {
    auto done = act(camera.get());
    camera.reset();
    return done;
  });
  auto result = task.get_future();
  std::thread(std::move(task)).detach();
  if (result.wait_for(deadline.left(clock_)) != std::future_status::ready) {
    pending_ = result.share();
    mark(lost_);
    return fail(ErrorCode::timeout, "{}: no reply in time to {}; check power, cable and network", name(), what);
  }
  auto done = result.get();
  if (!done) mark(lost_);  // a device that does not reply is connected again
  return done;
}

Result<void> AravisSensor::select_output(const std::string& output, Deadline deadline) {
  const auto act = [outputs = options_.strobe_outputs, output, attempt = attempt_](ArvCamera* camera) {
    return scanrig::select_output(camera, outputs, output, attempt);
  };
  return request("switch its outputs", act, deadline);
}

Result<void> AravisSensor::start_exposure(Deadline deadline) {
  return request(
      "expose", [attempt = attempt_](ArvCamera* camera) { return trigger_by_software(camera, attempt); }, deadline);
}

}  // namespace scanrig
