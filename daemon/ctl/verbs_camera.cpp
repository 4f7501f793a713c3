#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/image_codec.h"
#include "core/signal_stop.h"
#include "daemon/ctl/client.h"
#include "daemon/ctl/offline_rig_config.h"
#include "daemon/ctl/verbs.h"
#include "daemon/rig/open_devices.h"
#include "daemon/rig/preview.h"
#include "drivers/camera/camera_list.h"

namespace scanrig::ctl {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kConnectLimit{10};
constexpr seconds kExposureLimit{2};
constexpr milliseconds kPeriod{200};
constexpr int kTries = 4;

/// The cameras, and their light, of a rig that no daemon uses.
class Bench {
 public:
  static Result<std::unique_ptr<Bench>> open(const CameraVerb& verb) {
    auto rig = offline_rig_config(verb.config);
    if (!rig) return pass_on(rig);
    auto& camera = rig->stereo_camera;
    if (camera.driver == config::StereoCameraConfig::Driver::simulated) {
      return fail(ErrorCode::unsupported, "{}: simulated cameras belong to scanrigd-sim", verb.config.string());
    }
    if (verb.exposure_us) camera.aravis.exposure = camera.v4l2.exposure = std::chrono::microseconds(*verb.exposure_us);
    if (verb.gain) {
      camera.aravis.gain = verb.gain;
      camera.v4l2.gain = static_cast<int>(std::lround(*verb.gain));
    }
    std::unique_ptr<Bench> bench(new Bench(std::move(*rig)));
    auto devices = open_devices(bench->rig_, bench->clock_);
    if (!devices) return pass_on(devices);
    bench->devices_ = std::move(*devices);
    const auto ready = bench->devices_.camera->prepare(Deadline::after(bench->clock_, kConnectLimit));
    if (!ready) return tl::unexpected(of_device(ready.error()));
    return bench;
  }

  /// `light`: none, pattern or plain. A bad exposure is retaken, as the daemon does.
  Result<StereoFrame> expose(const std::string& light) {
    auto pair = expose_once(light);
    for (int i = 1; i < kTries && !pair; ++i) {
      if (pair.error().code != ErrorCode::timeout && pair.error().code != ErrorCode::protocol) break;
      pair = expose_once(light);
    }
    return std::move(pair).map_error(of_device);
  }
  Clock& clock() { return clock_; }

 private:
  explicit Bench(config::RigConfig rig) : rig_(std::move(rig)) {}
  Deadline deadline() { return Deadline::after(clock_, kExposureLimit); }

  Result<StereoFrame> expose_once(const std::string& light) {
    auto& camera = *devices_.camera;
    if (light == "none") return camera.capture_preview(deadline());
    if (auto armed = camera.arm(deadline()); !armed) return pass_on(armed);
    const auto fired = devices_.projector->fire(light == "plain" ? Light::plain : Light::pattern, deadline());
    if (!fired) return pass_on(fired);
    return camera.collect(deadline());
  }

  const config::RigConfig rig_;
  RealClock clock_;
  OpenDevices devices_;
};

/// Prints at once; on one line, if not indented.
void print_json(const nlohmann::ordered_json& all, int indent = -1) {
  fmt::print("{}\n", all.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace));
  std::fflush(stdout);
}

ExitCode list(const CameraVerb& verb) {
  auto found = find_aravis_cameras();
  for (auto& camera : find_v4l2_cameras(kernel_video())) found.push_back(std::move(camera));
  if (verb.json) {
    auto all = nlohmann::ordered_json::array();
    for (const auto& c : found) {
      all.push_back({{"kind", c.kind}, {"name", c.name}, {"serial", c.serial}, {"where", c.where}});
    }
    print_json(all, 2);
    return ExitCode::ok;
  }
  if (found.empty()) fmt::print("no camera found; check power, cable and network\n");
  for (const auto& c : found) fmt::print("{:<11} {:<16} {:<16} {}\n", c.kind, c.serial, c.where, c.name);
  return ExitCode::ok;
}

void tell_files(const CameraVerb& verb, const std::filesystem::path& left, const std::filesystem::path& right) {
  if (verb.json) return print_json({{"left", left.string()}, {"right", right.string()}});
  fmt::print("{}\n{}\n", left.string(), right.string());
}

/// Remedy for an image; empty: nothing.
std::string_view advice(const ImageQuality& evidence) {
  constexpr double kDim = 0.03, kFull = 0.01;
  if (evidence.saturated > kFull) return "too bright: lower exposure_us or gain";
  if (evidence.brightness < kDim) return "dim: raise exposure_us, gain or light";
  return "";
}

nlohmann::ordered_json to_json(const ImageQuality& evidence) {
  return {{"brightness", evidence.brightness},
          {"saturated", evidence.saturated},
          {"blur_px", evidence.blur_px},
          {"advice", advice(evidence)}};
}

void tell(const CameraVerb& verb, const StereoFrame& pair) {
  if (verb.json) return print_json({{"left", to_json(pair.left_evidence)}, {"right", to_json(pair.right_evidence)}});
  for (const auto& [side, evidence] :
       {std::pair("left", pair.left_evidence), std::pair("right", pair.right_evidence)}) {
    const auto what_to_do = advice(evidence);
    fmt::print("{:<5}  brightness {:5.1f} %  at full scale {:5.2f} %  blur {:4.2f} px{}{}\n", side,
               100 * evidence.brightness, 100 * evidence.saturated, evidence.blur_px, what_to_do.empty() ? "" : "  ",
               what_to_do);
  }
  std::fflush(stdout);
}

ExitCode tune(const CameraVerb& verb, Bench& bench) {
  const SignalStop signal;
  for (int i = 0; (verb.count == 0 || i < verb.count) && !signal.token().stop_requested(); ++i) {
    if (i > 0) bench.clock().sleep_for(kPeriod);
    const auto pair = bench.expose(verb.light);
    if (!pair) return report_error(pair.error());
    tell(verb, *pair);
  }
  return ExitCode::ok;
}

Result<void> write_png(const std::filesystem::path& file, const cv::Mat& image) {
  const auto bytes = encode_png(image);
  if (!bytes) return pass_on(bytes);
  return write_file_atomically(file, *bytes);
}

ExitCode grab(const CameraVerb& verb, Bench& bench) {
  const auto left = verb.out / "left.png", right = verb.out / "right.png";
  for (const auto& file : {left, right}) {
    if (!std::filesystem::exists(file)) continue;
    return report_error({ErrorCode::exists, file.string() + " is already there: name another folder"});
  }
  const auto pair = bench.expose(verb.light);
  if (!pair) return report_error(pair.error());
  if (auto made = create_directories_synced(verb.out); !made) return report_error(made.error());
  for (const auto& [file, image] : {std::pair(left, pair->left), std::pair(right, pair->right)}) {
    if (auto written = write_png(file, image); !written) return report_error(written.error());
  }
  tell_files(verb, left, right);
  return ExitCode::ok;
}

/// One image of each side, newer than the last; the error where there is none.
using TakePictures = std::function<tl::expected<std::array<std::string, 2>, RequestError>()>;

ExitCode preview(const CameraVerb& verb, const TakePictures& take, Clock& clock) {
  if (auto made = create_directories_synced(verb.out); !made) return report_error(made.error());
  const auto left = verb.out / "left.jpg", right = verb.out / "right.jpg";
  if (!verb.json) fmt::print("{} and {} follow the cameras\n", left.string(), right.string());
  std::fflush(stdout);
  const SignalStop signal;
  for (int i = 0; (verb.count == 0 || i < verb.count) && !signal.token().stop_requested(); ++i) {
    if (i > 0) clock.sleep_for(kPeriod);
    const auto pictures = take();
    if (!pictures) return report_error(pictures.error().exit, pictures.error().message);
    for (const auto& [file, jpeg] : {std::pair(left, (*pictures)[0]), std::pair(right, (*pictures)[1])}) {
      if (auto written = write_file_atomically(file, jpeg); !written) return report_error(written.error());
    }
    if (verb.json) tell_files(verb, left, right);
  }
  return ExitCode::ok;
}

/// The daemon's first reply only requests an image from the cameras.
ExitCode preview_of_daemon(const CameraVerb& verb, const std::filesystem::path& socket) {
  RealClock clock;
  const auto fetch_side = [&](const char* side) {
    const auto target = std::string("/api/v1/preview/") + side;
    auto picture = fetch(socket, target);
    for (const auto by = Deadline::after(clock, kConnectLimit);
         !picture && picture.error().exit == ExitCode::bad_input && !by.expired(clock);
         picture = fetch(socket, target)) {
      clock.sleep_for(kPeriod);
    }
    return picture;
  };
  return preview(
      verb,
      [&]() -> tl::expected<std::array<std::string, 2>, RequestError> {
        auto left = fetch_side("left");
        if (!left) return tl::unexpected(left.error());
        auto right = fetch_side("right");
        if (!right) return tl::unexpected(right.error());
        return std::array{std::move(*left), std::move(*right)};
      },
      clock);
}

ExitCode preview_of_cameras(const CameraVerb& verb, Bench& bench) {
  Preview pictures(bench.clock(), [] { return true; });
  const auto told = [](const Error& error) {
    return tl::unexpected(RequestError{exit_code(error.code), error.message});
  };
  return preview(
      verb,
      [&]() -> tl::expected<std::array<std::string, 2>, RequestError> {
        const auto pair = bench.expose(verb.light);
        if (!pair) return told(pair.error());
        pictures.keep(*pair);
        auto left = pictures.jpeg(Side::left), right = pictures.jpeg(Side::right);
        if (!left) return told(left.error());
        if (!right) return told(right.error());
        return std::array{std::move(*left), std::move(*right)};
      },
      bench.clock());
}

}  // namespace

ExitCode camera(const CameraVerb& verb) {
  if (verb.what == "list") return list(verb);
  if (verb.what == "preview") {
    const auto rig = config::read_rig_config(verb.config, {}, config::Cameras::or_simulated);
    if (!rig) return report_error(rig.error());
    if (send_request(rig->api.socket, "GET", "/api/v1/status")) return preview_of_daemon(verb, rig->api.socket);
  }
  const auto bench = Bench::open(verb);
  if (!bench) return report_error(bench.error());
  if (verb.what == "preview") return preview_of_cameras(verb, **bench);
  return verb.what == "tune" ? tune(verb, **bench) : grab(verb, **bench);
}

}  // namespace scanrig::ctl
