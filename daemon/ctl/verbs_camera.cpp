#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/image_codec.h"
#include "core/signal_stop.h"
#include "daemon/ctl/camera_bench.h"
#include "daemon/ctl/client.h"
#include "daemon/ctl/verbs.h"
#include "daemon/rig/preview.h"
#include "drivers/camera/camera_list.h"
#include "pipeline/characterise/characterisation_file.h"

namespace scanrig::ctl {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kConnectLimit{10};
constexpr milliseconds kPeriod{200};

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

/// Brightness below which an image is dim, by the noise of each camera, 0 to 1.
using DimLimits = std::array<double, 2>;

/// Of the rig's cameras, as they are characterised; a file of other cameras is named, and not used.
DimLimits dim_limits(const config::RigConfig& rig) {
  constexpr double kUnknown = 0.03, kReadNoises = 10.0, kFullScale = 255.0;
  DimLimits limits{kUnknown, kUnknown};
  const auto [left, right] = rig.stereo_camera.serials();
  const auto file = rig.calibration_file.parent_path() / kCharacterisationFile;
  for (const auto& [side, serial] : {std::pair(0U, left), std::pair(1U, right)}) {
    const auto noise = noise_model_of(file, serial);
    if (!noise) fmt::print(stderr, "{}\n", as_sentence(noise.error().message));
    if (!noise || !noise->is_measured) continue;
    limits.at(side) = (noise->black + kReadNoises * noise->read_noise) / kFullScale;
  }
  return limits;
}

/// Remedy for an image; empty: nothing.
std::string_view advice(const ImageQuality& evidence, double dim_limit) {
  constexpr double kFull = 0.01;
  if (evidence.saturated > kFull) return "too bright: lower exposure_us or gain";
  if (evidence.brightness < dim_limit) return "dim: raise exposure_us, gain or light";
  return "";
}

nlohmann::ordered_json to_json(const ImageQuality& evidence, double dim_limit) {
  return {{"brightness", evidence.brightness},
          {"saturated", evidence.saturated},
          {"blur_px", evidence.blur_px},
          {"advice", advice(evidence, dim_limit)}};
}

void tell(const CameraVerb& verb, const StereoFrame& pair, const DimLimits& limits) {
  if (verb.json) {
    return print_json(
        {{"left", to_json(pair.left_evidence, limits[0])}, {"right", to_json(pair.right_evidence, limits[1])}});
  }
  for (const auto& [side, evidence, limit] :
       {std::tuple("left", pair.left_evidence, limits[0]), std::tuple("right", pair.right_evidence, limits[1])}) {
    const auto what_to_do = advice(evidence, limit);
    fmt::print("{:<5}  brightness {:5.1f} %  at full scale {:5.2f} %  blur {:4.2f} px{}{}\n", side,
               100 * evidence.brightness, 100 * evidence.saturated, evidence.blur_px, what_to_do.empty() ? "" : "  ",
               what_to_do);
  }
  std::fflush(stdout);
}

ExitCode tune(const CameraVerb& verb, CameraBench& bench) {
  const SignalStop signal;
  const DimLimits limits = dim_limits(bench.rig());
  for (int i = 0; (verb.count == 0 || i < verb.count) && !signal.token().stop_requested(); ++i) {
    if (i > 0) bench.clock().sleep_for(kPeriod);
    const auto pair = bench.expose(verb.light);
    if (!pair) return report_error(pair.error());
    tell(verb, *pair, limits);
  }
  return ExitCode::ok;
}

Result<void> write_png(const std::filesystem::path& file, const cv::Mat& image) {
  const auto bytes = encode_png(image);
  if (!bytes) return pass_on(bytes);
  return write_file_atomically(file, *bytes);
}

ExitCode grab(const CameraVerb& verb, CameraBench& bench) {
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

ExitCode preview_of_cameras(const CameraVerb& verb, CameraBench& bench) {
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
  const auto bench = CameraBench::open(verb.config, {verb.exposure_us, verb.gain});
  if (!bench) return report_error(bench.error());
  if (verb.what == "preview") return preview_of_cameras(verb, **bench);
  return verb.what == "tune" ? tune(verb, **bench) : grab(verb, **bench);
}

}  // namespace scanrig::ctl
