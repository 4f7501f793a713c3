#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/rig/open_devices.h"
#include "drivers/camera/network_card.h"

namespace scanrig::ctl::doctor {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kConnectTimeout{10};
constexpr std::chrono::seconds kExposureTimeout{2};
constexpr std::chrono::seconds kTrial{20};
constexpr std::chrono::milliseconds kPeriod{400};  ///< slow enough for eyes, with time for a warm-up after a failure
constexpr int kHopeless = 12;                      ///< first exposures without a pair: the rest is not tried
constexpr int kGigabit = 1000, kUsb3 = 5000;       ///< Mbit/s
constexpr double kTolerated = 0.02;                ///< share of the exposures that may fail

/// The sentence of a driver's error without its remedy.
std::string cause_of(const Error& error) { return error.message.substr(0, error.message.find("; ")); }

/// `slow_cards`: named in a finding already.
void examine_network(const AravisSensorOptions& sensor, const char* side, const fs::path& root,
                     std::set<std::string>& slow_cards, Report& report) {
  const auto card = network_card_to(sensor.address, root.string());
  if (!card) return report.note(fmt::format("{} camera: no route to {}", side, sensor.address));
  report.note(fmt::format(
      "{} camera at {}: through {}, {}, packets of up to {} bytes", side, sensor.address, card->name,
      card->speed_mbit ? fmt::format("{} Mbit/s", *card->speed_mbit) : "speed not reported", path_mtu(sensor.address)));
  if (!card->speed_mbit || *card->speed_mbit >= kGigabit || !slow_cards.insert(card->name).second) return;
  report.find(
      "slow_link",
      fmt::format("The network card {} towards the {} camera runs at {} Mbit/s.", card->name, side, *card->speed_mbit),
      "Use a port, a switch and a cable of 1000 Mbit/s: all eight wires, Cat 5e or better.");
}

/// Speed of the USB device with this serial number, Mbit/s [Linux, sysfs-bus-usb]; nothing if there is none.
std::optional<int> usb_speed(const std::string& serial, const fs::path& root) {
  std::error_code error;
  for (fs::directory_iterator device(root / "sys/bus/usb/devices", error), end; !error && device != end;
       device.increment(error)) {
    std::string own;
    int speed = 0;
    if (!(std::ifstream(device->path() / "serial") >> own) || own != serial) continue;
    if (std::ifstream(device->path() / "speed") >> speed) return speed;
  }
  return std::nullopt;
}

/// `is_usb3_needed`: a USB3 Vision camera; a webcam may be slower.
void examine_usb(const std::string& serial, const char* side, bool is_usb3_needed, const fs::path& root,
                 Report& report) {
  const auto speed = usb_speed(serial, root);
  if (!speed) return;
  report.note(fmt::format("{} camera {}: USB at {} Mbit/s", side, serial, *speed));
  if (!is_usb3_needed || *speed >= kUsb3) return;
  report.find("slow_link", fmt::format("The {} camera {} is connected by USB at {} Mbit/s.", side, serial, *speed),
              "Plug it into a USB 3 port of its own, with the cable that came with it and no hub.");
}

void examine_links(const AravisOptions& options, const fs::path& root, Report& report) {
  std::set<std::string> slow_cards;
  for (const auto& [sensor, side] : {std::pair(options.left, "left"), std::pair(options.right, "right")}) {
    if (sensor.address.empty()) {
      examine_usb(sensor.serial, side, true, root, report);
    } else {
      examine_network(sensor, side, root, slow_cards, report);
    }
  }
}

void report_connecting(const Error& error, Report& report) {
  const bool is_different = error.code == ErrorCode::invalid_input || error.code == ErrorCode::unsupported;
  if (is_different) {
    return report.find("camera_settings", cause_of(error) + ".", "Correct the key of [stereo_camera] that this is of.");
  }
  report.find("camera_missing", cause_of(error) + ".",
              "Check the camera's power, cable and network; scanrig camera list shows what replies.");
}

/// Makes the projector dark on every way out.
class DarkAtEnd {
 public:
  DarkAtEnd(Projector& projector, Clock& clock) : projector_(projector), clock_(clock) {}
  ~DarkAtEnd() { std::ignore = projector_.turn_off(Deadline::after(clock_, kExposureTimeout)); }
  DarkAtEnd(const DarkAtEnd&) = delete;
  DarkAtEnd& operator=(const DarkAtEnd&) = delete;

 private:
  Projector& projector_;
  Clock& clock_;
};

/// Exposures one after the other, and their count.
class CameraTrial {
 public:
  CameraTrial(OpenDevices& devices, Clock& clock, const std::stop_token& stop)
      : camera_(*devices.camera), projector_(*devices.projector), clock_(clock), stop_(stop) {}

  /// Exposes for 20 s. Fails with `stopped`.
  Result<void> run() {
    if (auto off = camera_.capture_preview(deadline())) images_.off = std::move(*off);
    const auto begin = clock_.now(), end = begin + kTrial;
    for (auto next = begin; next < end && !is_hopeless() && !projector_error_; next += kPeriod) {
      if (stop_.stop_requested()) return fail(ErrorCode::stopped, "stopped on request");
      clock_.sleep_until(next);
      expose(has_plain_ && fired_ % 2 == 1 ? Light::plain : Light::pattern);
      next = std::max(next, clock_.now() - kPeriod);  // no haste after a slow one
    }
    return {};
  }
  void judge(Report& report) const;
  [[nodiscard]] TrialImages take_images() { return std::move(images_); }

 private:
  [[nodiscard]] Deadline deadline() const { return Deadline::after(clock_, kExposureTimeout); }
  [[nodiscard]] bool is_hopeless() const { return pairs_ == 0 && fired_ >= kHopeless; }

  void expose(Light light) {
    if (const auto armed = camera_.arm(deadline()); !armed) return count_failure(armed.error());
    if (const auto fired = projector_.fire(light, deadline()); !fired) {
      if (light == Light::plain && fired.error().code == ErrorCode::unsupported) {
        has_plain_ = false;
      } else {
        projector_error_ = fired.error();
      }
      return;
    }
    auto pair = camera_.collect(deadline());
    if (!pair) return count_failure(pair.error());
    ++fired_;
    ++pairs_;
    images_.keep(light, std::move(*pair));
  }
  void count_failure(const Error& error) {
    ++fired_;
    last_error_ = error;
  }

  SensorCamera& camera_;
  Projector& projector_;
  Clock& clock_;
  const std::stop_token stop_;
  TrialImages images_;
  bool has_plain_ = true;
  int fired_ = 0, pairs_ = 0;
  std::optional<Error> last_error_, projector_error_;
};

void CameraTrial::judge(Report& report) const {
  const TriggerCounts& counts = camera_.counts();
  const auto odd = counts.old + counts.odd;
  report.note(fmt::format("{} exposures: {} pairs, {} lost, {} with missing packets, {} out of order", fired_, pairs_,
                          counts.lost, counts.torn, odd));
  if (projector_error_) {
    return report.find("projector", cause_of(*projector_error_) + ".", "Check the projector's power and wiring.");
  }
  if (!last_error_ || fired_ - pairs_ <= kTolerated * fired_) return;
  const std::string cause = cause_of(*last_error_);
  if (counts.torn > counts.lost && counts.torn >= odd) {
    return report.find(
        "packets_lost", fmt::format("Of {} exposures {} came with missing packets: {}.", fired_, counts.torn, cause),
        "Raise packet.delay_us, give the cameras a network card of their own, and do as the sentence says.");
  }
  if (pairs_ == 0 && counts.lost > 0 && !images_.off.left.empty()) {
    return report.find(
        "no_trigger",
        fmt::format("The cameras expose by software, but of {} trigger edges none exposed both: {}.", fired_, cause),
        "Check the wire from the projector to the cameras' trigger inputs, and trigger.source.");
  }
  report.find("frames_lost",
              fmt::format("Of {} exposures {} gave no pair of images: {}.", fired_, fired_ - pairs_, cause),
              "Check trigger wire, network cable and switch; let nothing else use this network.");
}

void examine_buffers(const config::StereoCameraConfig& camera, const StereoFrame& frame, const fs::path& root,
                     Report& report) {
  if (camera.driver != config::StereoCameraConfig::Driver::aravis || frame.left.empty()) return;
  const bool is_usb = camera.aravis.left.address.empty() && usb_speed(camera.aravis.left.serial, root);
  const auto finding = host_finding(is_usb ? CameraBus::usb3 : CameraBus::gige,
                                    frame.left.total() * frame.left.elemSize(), root.string());
  if (!finding) return;
  const auto remedy = finding->find(": ");
  report.find("receive_buffer", fmt::format("The machine may lose frames: {}.", finding->substr(0, remedy)),
              fmt::format("Do this for good, in /etc: {}.", finding->substr(std::min(finding->size(), remedy + 2))));
}

}  // namespace

void TrialImages::keep(Light light, StereoFrame frame) {
  auto& [left, right] = brightness[light == Light::plain];
  left.push_back(frame.left_evidence.brightness);
  right.push_back(frame.right_evidence.brightness);
  (light == Light::plain ? plain : pattern) = std::move(frame);
}

Result<TrialImages> examine_cameras(const Rig& rig, const std::stop_token& stop, Clock& clock, Report& report) {
  report.section("Cameras");
  const auto& camera = rig.config.stereo_camera;
  if (camera.driver == config::StereoCameraConfig::Driver::aravis) {
    examine_links(camera.aravis, rig.machine_root, report);
  } else {
    examine_usb(camera.v4l2.left.serial, "left", false, rig.machine_root, report);
  }
  auto devices = open_devices(rig.config, clock);
  if (!devices) {
    report.find("projector", devices.error().message + ".", "Correct the configuration.");
    return TrialImages{};
  }
  const DarkAtEnd dark(*devices->projector, clock);
  if (const auto ready = devices->camera->prepare(Deadline::after(clock, kConnectTimeout)); !ready) {
    report_connecting(ready.error(), report);
    return TrialImages{};
  }
  report.note(fmt::format("both are connected and set up, exposure {} us accepted", camera.exposure.count()));
  CameraTrial trial(*devices, clock, stop);
  if (auto ran = trial.run(); !ran) return pass_on(ran);
  trial.judge(report);
  auto images = trial.take_images();
  images.has_cameras = true;
  examine_buffers(camera, images.pattern, rig.machine_root, report);
  return images;
}

}  // namespace scanrig::ctl::doctor
