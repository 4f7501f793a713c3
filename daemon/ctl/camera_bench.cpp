#include "daemon/ctl/camera_bench.h"

#include <cmath>

#include "daemon/ctl/offline_rig_config.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

constexpr std::chrono::seconds kOpenLimit{10};
constexpr std::chrono::seconds kExposureLimit{2};
constexpr int kTries = 4;

}  // namespace

Result<std::unique_ptr<CameraBench>> CameraBench::open(const std::filesystem::path& config,
                                                       const ExposureOptions& options) {
  auto rig = offline_rig_config(config);
  if (!rig) return pass_on(rig);
  auto& camera = rig->stereo_camera;
  if (camera.driver == config::StereoCameraConfig::Driver::simulated) {
    return fail(ErrorCode::unsupported, "{}: simulated cameras belong to scanrigd-sim", config.string());
  }
  if (options.exposure_us) {
    camera.aravis.exposure = camera.v4l2.exposure = std::chrono::microseconds(*options.exposure_us);
  }
  if (options.gain) {
    camera.aravis.gain = options.gain;
    camera.v4l2.gain = static_cast<int>(std::lround(*options.gain));
  }
  std::unique_ptr<CameraBench> bench(new CameraBench(std::move(*rig)));
  auto devices = open_devices(bench->rig_, bench->clock_);
  if (!devices) return pass_on(devices);
  bench->devices_ = std::move(*devices);
  const auto ready = bench->devices_.camera->prepare(Deadline::after(bench->clock_, kOpenLimit));
  if (!ready) return tl::unexpected(of_device(ready.error()));
  return bench;
}

Result<StereoFrame> CameraBench::expose(const std::string& light) {
  auto pair = expose_once(light);
  for (int i = 1; i < kTries && !pair; ++i) {
    if (pair.error().code != ErrorCode::timeout && pair.error().code != ErrorCode::protocol) break;
    pair = expose_once(light);
  }
  return std::move(pair).map_error(of_device);
}

Deadline CameraBench::deadline() { return Deadline::after(clock_, kExposureLimit); }

Result<StereoFrame> CameraBench::expose_once(const std::string& light) {
  auto& camera = *devices_.camera;
  if (light == "none") return camera.capture_preview(deadline());
  if (auto armed = camera.arm(deadline()); !armed) return pass_on(armed);
  const auto fired = devices_.projector->fire(light == "plain" ? Light::plain : Light::pattern, deadline());
  if (!fired) return pass_on(fired);
  return camera.collect(deadline());
}

}  // namespace scanrig::ctl
