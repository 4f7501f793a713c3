#include <cmath>
#include <fstream>

#include "drivers/camera/aravis_sensor.h"
#include "drivers/camera/aravis_strobe.h"
#include "drivers/camera/network_card.h"

namespace scanrig {
namespace {

/// Frames come on triggers only, and on one kind of trigger only.
Result<void> set_up_trigger(ArvCamera* camera, const AravisOptions& options, const GenicamCall& attempt) {
  if (has_feature(camera, "AcquisitionFrameRateEnable")) {
    auto off = attempt("set AcquisitionFrameRateEnable", [&](GError** error) {
      arv_camera_set_boolean(camera, "AcquisitionFrameRateEnable", FALSE, error);
    });
    if (!off) return off;
  }
  auto cleared = attempt("switch the triggers off", [&](GError** error) { arv_camera_clear_triggers(camera, error); });
  if (!cleared) return cleared;
  const char* selector = nullptr;
  for (const char* candidate : {"FrameStart", "FrameBurstStart", "AcquisitionStart"}) {
    if (!selector && has_entry(camera, "TriggerSelector", candidate)) selector = candidate;
  }
  if (!selector || !has_feature(camera, "TriggerSoftware")) {
    return fail(ErrorCode::unsupported, "{}: the camera has no {}", attempt.who(),
                selector ? "TriggerSoftware" : "trigger that starts a frame");
  }
  if (auto set = set_text(camera, "TriggerSelector", selector, attempt); !set) return set;
  if (auto set = set_trigger_source(camera, options.trigger_source, attempt); !set) return set;
  const char* edge = options.falling_edge ? "FallingEdge" : "RisingEdge";
  if (has_feature(camera, "TriggerActivation") || options.falling_edge) {
    if (auto set = set_text(camera, "TriggerActivation", edge, attempt); !set) return set;
  }
  return set_text(camera, "TriggerMode", "On", attempt);
}

Result<void> set_up_image(ArvCamera* camera, const AravisOptions& options, const GenicamCall& attempt) {
  if (!has_entry(camera, "PixelFormat", options.pixel_format)) {
    return fail(ErrorCode::unsupported, "{}: the camera has no pixel format {}", attempt.who(), options.pixel_format);
  }
  if (auto set = set_text(camera, "PixelFormat", options.pixel_format, attempt); !set) return set;
  if (options.region) {
    const Region& r = *options.region;
    auto set = attempt(fmt::format("read out {}x{} at ({}, {})", r.width, r.height, r.x, r.y),
                       [&](GError** error) { arv_camera_set_region(camera, r.x, r.y, r.width, r.height, error); });
    if (!set) return set;
  }
  for (const char* automatic : {"ExposureAuto", "GainAuto", "BalanceWhiteAuto"}) {
    if (!has_feature(camera, automatic)) continue;
    if (auto off = set_text(camera, automatic, "Off", attempt); !off) return off;
  }
  if (options.gain) {
    auto set = attempt(fmt::format("set the gain to {}", *options.gain),
                       [&](GError** error) { arv_camera_set_gain(camera, *options.gain, error); });
    if (!set) return set;
  }
  const auto wanted = static_cast<double>(options.exposure.count());
  double got = 0.0;
  auto set = attempt(fmt::format("set the exposure to {} us", options.exposure.count()), [&](GError** error) {
    arv_camera_set_exposure_time(camera, wanted, error);
    if (!*error) got = arv_camera_get_exposure_time(camera, error);
  });
  if (!set) return set;
  constexpr double kCoarse = 0.05;  // cameras round to lines of the sensor
  if (std::abs(got - wanted) > kCoarse * wanted) {
    return fail(ErrorCode::invalid_input, "{}: asked for an exposure of {} us it takes {:.0f} us", attempt.who(),
                options.exposure.count(), got);
  }
  return {};
}

Result<void> set_up_packets(ArvCamera* camera, const AravisOptions& options, const std::string& address,
                            const GenicamCall& attempt) {
  if (!arv_camera_is_gv_device(camera)) return {};
  // A raw packet socket would need a capability that the service does not have.
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  const int mtu = path_mtu(address);
  if (mtu > 0 && options.packet_bytes > mtu) {
    return fail(ErrorCode::invalid_input,
                "{}: packets of {} bytes do not pass the network card, whose MTU is {}: raise the MTU (9000) or lower "
                "packet.size_bytes",
                attempt.who(), options.packet_bytes, mtu);
  }
  if (options.packet_bytes > 0) {
    guint got = 0;
    auto set = attempt(fmt::format("set packets of {} bytes", options.packet_bytes), [&](GError** error) {
      arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
      arv_camera_gv_set_packet_size(camera, options.packet_bytes, error);
      if (!*error) got = arv_camera_gv_get_packet_size(camera, error);
    });
    if (!set) return set;
    if (got != static_cast<guint>(options.packet_bytes)) {
      return fail(ErrorCode::invalid_input, "{}: asked for packets of {} bytes it sends {}", attempt.who(),
                  options.packet_bytes, got);
    }
  }
  if (options.packet_delay.count() == 0) return {};
  return attempt("set the packet delay", [&](GError** error) {
    arv_camera_gv_set_packet_delay(camera, std::chrono::nanoseconds(options.packet_delay).count(), error);
  });
}

Result<void> set_up_clock(ArvCamera* camera, const AravisOptions& options, const GenicamCall& attempt) {
  if (options.frame_clock != TriggeringOptions::FrameClock::ptp) return {};
  for (const char* feature : {"PtpEnable", "GevIEEE1588"}) {
    if (!has_feature(camera, feature)) continue;
    return attempt("switch PTP on", [&](GError** error) { arv_camera_set_boolean(camera, feature, TRUE, error); });
  }
  return fail(ErrorCode::unsupported, "{}: the camera has no PTP; use clock = \"interval\"", attempt.who());
}

/// First number in a kernel file; nothing if there is none.
std::optional<std::uint64_t> read_number(const std::string& file) {
  std::ifstream in(file);
  std::uint64_t number = 0;
  if (!(in >> number)) return std::nullopt;
  return number;
}

}  // namespace

Result<void> set_trigger_source(ArvCamera* camera, const std::string& source, const GenicamCall& attempt) {
  return set_text(camera, "TriggerSource", source, attempt);
}

Result<void> set_up(ArvCamera* camera, const AravisOptions& options, const std::string& address,
                    const GenicamCall& attempt) {
  auto continuous = attempt("set AcquisitionMode", [&](GError** error) {
    arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, error);
  });
  if (!continuous) return continuous;
  if (auto done = set_up_image(camera, options, attempt); !done) return done;
  if (auto done = set_up_outputs(camera, options.strobe_outputs, attempt); !done) return done;
  if (auto done = set_up_trigger(camera, options, attempt); !done) return done;
  if (auto done = set_up_packets(camera, options, address, attempt); !done) return done;
  return set_up_clock(camera, options, attempt);
}

std::unique_ptr<SensorCamera> aravis_camera(const AravisOptions& options, Clock& clock) {
  AravisOptions left = options, right = options;
  if (!options.strobe_outputs.empty()) left.trigger_source = "Software";
  right.strobe_outputs.clear();
  std::vector<std::unique_ptr<Sensor>> sensors;
  sensors.push_back(std::make_unique<AravisSensor>("left", options.left, left, clock));
  sensors.push_back(std::make_unique<AravisSensor>("right", options.right, right, clock));
  TriggeringOptions triggering;
  triggering.by = options.trigger_source == "Software" ? TriggeringOptions::By::software : TriggeringOptions::By::line;
  triggering.frame_clock = options.frame_clock;
  triggering.frame_timeout = options.frame_timeout;
  triggering.idle_refresh = options.idle_refresh;
  return std::make_unique<SensorCamera>(std::move(sensors), triggering, clock);
}

Result<std::unique_ptr<SensorCamera>> open_aravis(const AravisOptions& options, Clock& clock, Deadline deadline) {
  auto camera = aravis_camera(options, clock);
  if (auto ready = camera->prepare(deadline); !ready) return pass_on(ready);
  return camera;
}

std::optional<std::string> host_finding(CameraBus bus, std::size_t frame_bytes, const std::string& root) {
  if (bus == CameraBus::gige) {
    // The kernel counts its own overhead: about twice the payload.
    const auto limit = read_number(root + "/proc/sys/net/core/rmem_max");
    if (!limit || *limit >= 2 * frame_bytes) return std::nullopt;
    return fmt::format("a socket may buffer {} bytes, too few for a frame of {}: set net.core.rmem_max to at least {}",
                       *limit, frame_bytes, 2 * frame_bytes);
  }
  constexpr std::size_t kPair = 2, kMega = 1024 * 1024;
  const auto limit = read_number(root + "/sys/module/usbcore/parameters/usbfs_memory_mb");
  const std::size_t needed = (kPair * kBuffers * frame_bytes + kMega - 1) / kMega;
  if (!limit || *limit == 0 || *limit >= needed) return std::nullopt;  // 0: no limit
  return fmt::format("USB transfers may use {} MB of memory, two USB3 cameras need {}: set usbcore.usbfs_memory_mb",
                     *limit, needed);
}

}  // namespace scanrig
