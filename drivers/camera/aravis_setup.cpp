#include "drivers/camera/aravis_setup.h"

#include <fstream>

#include "drivers/camera/aravis_sensor.h"
#include "drivers/camera/aravis_strobe.h"
#include "drivers/camera/network_card.h"

namespace scanrig {
namespace {

/// Starts from what the maker has tested. Returns whether it could. A camera whose clock follows PTP keeps its
/// settings: loading others would switch PTP off, and it needs longer to follow again than a call may wait.
Result<bool> load_standard(ArvCamera* camera, const AravisOptions& options, const GenicamCall& attempt) {
  const bool keeps_clock = options.frame_clock == TriggeringOptions::FrameClock::ptp && has_ptp_on(camera);
  if (keeps_clock || !has_feature(camera, "UserSetLoad") || !has_entry(camera, "UserSetSelector", "Default")) {
    return false;
  }
  if (auto set = set_text(camera, "UserSetSelector", "Default", attempt); !set) return pass_on(set);
  if (auto loaded = execute(camera, "UserSetLoad", attempt); !loaded) return pass_on(loaded);
  return true;
}

Result<void> switch_triggers_off(ArvCamera* camera, const GenicamCall& attempt) {
  for (const std::string& trigger : entries_of(camera, "TriggerSelector")) {
    if (auto set = set_text(camera, "TriggerSelector", trigger, attempt); !set) return set;
    if (auto off = set_entry_if_present(camera, "TriggerMode", "Off", attempt); !off) return off;
  }
  return {};
}

/// Frames come on triggers only, and on one kind of trigger only. The camera is left waiting for its software trigger,
/// with which the count of frames begins.
Result<void> set_up_trigger(ArvCamera* camera, const AravisOptions& options, const GenicamCall& attempt) {
  if (auto off = set_flag_if_present(camera, "AcquisitionFrameRateEnable", false, attempt); !off) return off;
  if (auto off = switch_triggers_off(camera, attempt); !off) return off;
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
  constexpr double kDelayUs = 0.0, kCoarseUs = 10.0;
  if (auto set = set_number_if_present(camera, "TriggerDelay", kDelayUs, kCoarseUs, attempt); !set) return set;
  // Pattern and plain light follow each other faster than some sensors are read out.
  if (auto set = set_entry_if_present(camera, "TriggerOverlap", "ReadOut", attempt); !set) return set;
  if (auto set = set_text(camera, "TriggerMode", "On", attempt); !set) return set;
  return set_trigger_source(camera, "Software", attempt);
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
  gint64 got = 0;
  const auto wanted = std::chrono::nanoseconds(options.packet_delay).count();
  auto set = attempt("set the packet delay", [&](GError** error) {
    got = arv_camera_gv_get_packet_delay(camera, error);
    if (*error || got == wanted) return;
    arv_camera_gv_set_packet_delay(camera, wanted, error);
    if (!*error) got = arv_camera_gv_get_packet_delay(camera, error);
  });
  constexpr gint64 kCoarseNs = 1000;  // cameras count in ticks of their own
  if (!set || std::abs(got - wanted) <= std::max(kCoarseNs, wanted / 20)) return set;
  return fail(ErrorCode::invalid_input, "{}: asked for a packet delay of {} us it has {} us; choose one that it offers",
              attempt.who(), options.packet_delay.count(), got / 1000);
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

Result<void> set_up(ArvCamera* camera, const AravisOptions& options, const std::string& address, Clock& clock,
                    Deadline deadline, const GenicamCall& attempt) {
  // Another program may have left it acquiring, with most features locked. An idle camera may reject this.
  std::ignore = execute(camera, "AcquisitionStop", attempt);
  const auto is_standard = load_standard(camera, options, attempt);
  if (!is_standard) return pass_on(is_standard);
  if (auto set = set_text(camera, "AcquisitionMode", "Continuous", attempt); !set) return set;
  if (auto done = set_up_image(camera, options, *is_standard, attempt); !done) return done;
  if (auto done = set_up_outputs(camera, options.strobe_outputs, attempt); !done) return done;
  if (auto done = set_up_trigger(camera, options, attempt); !done) return done;
  if (auto done = set_up_packets(camera, options, address, attempt); !done) return done;
  return set_up_clock(camera, options, clock, deadline, attempt);
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
