#include "daemon/service/daemon_options.h"

#include "core/hash.h"
#include "daemon/jobs/pipeline_reconstructor.h"
#include "daemon/jobs/process_reconstructor.h"
#include "daemon/rig/open_devices.h"
#include "daemon/service/crash_report.h"

namespace scanrig {
namespace {

std::uintmax_t gib(double count) { return static_cast<std::uintmax_t>(count * (1u << 30)); }

/// V4L2 devices named by their path have no identity; two sensors in one device have one number.
CameraSerials cameras_from(const config::StereoCameraConfig& config) {
  using Driver = config::StereoCameraConfig::Driver;
  switch (config.driver) {
    case Driver::aravis: return {config.aravis.left.serial, config.aravis.right.serial};
    case Driver::v4l2:
    case Driver::v4l2_side_by_side:
      return {config.v4l2.left.serial, config.v4l2.right.value_or(config.v4l2.left).serial};
    case Driver::simulated: break;  // their owner has the numbers
  }
  return {};
}

Recipe recipe_from(const std::string& name, const config::RecipeConfig& config) {
  return {.name = name,
          .poses = config.poses,
          .views = config.views,
          .flip_timeout = config.flip_timeout,
          .flip_by_signal = config.flip == config::RecipeConfig::Flip::signal,
          .start_on_part = config.start == config::RecipeConfig::Start::part_present,
          .limits = {config.min_measured_share, config.max_residual_mm}};
}

ReconstructorFactory reconstructor_from(const config::ReconstructionConfig& config) {
  if (config.executor == config::ReconstructionConfig::Executor::process) {
    const auto outside = process_reconstructor(
        {.program = {}, .limit = config.timeout, .memory_bytes = gib(config.memory_gib), .voxel_mm = config.voxel_mm});
    return [=](const ReconstructionTask& task) -> Result<std::unique_ptr<Reconstructor>> {
      const auto voxel_mm = task.changes.voxel_mm.value_or(config.voxel_mm);
      if (auto fits = check_memory(task, voxel_mm, gib(config.memory_gib)); !fits) return pass_on(fits);
      return outside(task);
    };
  }
  ReconstructOptions options;
  options.voxel_mm = config.voxel_mm;
  return pipeline_reconstructor(options, gib(config.memory_gib));
}

}  // namespace

DaemonOptions options_from(const config::RigConfig& config) {
  DaemonOptions options;
  options.jobs = {.root = config.storage.root,
                  .calibration_file = config.calibration_file,
                  .cameras = cameras_from(config.stereo_camera),
                  .profile = "",
                  .config_sha256 = sha256(config.text),
                  .reserve_bytes = gib(config.storage.reserve_gib)};
  options.state_folder = crash_folder(config.storage.root).parent_path();
  options.recipes.clear();
  for (const auto& [name, recipe] : config.recipes) options.recipes[name] = recipe_from(name, recipe);
  options.retention.keep_for = config.storage.keep_days;
  if (config.storage.keep_gib) options.retention.keep_bytes = gib(*config.storage.keep_gib);
  options.bundle.rig_texts["rig.toml"] = config.text;
  if (const auto& profile = config.turntable.profile_file) options.bundle.rig_texts[profile->name] = profile->text;
  options.bundle.crash_folder = crash_folder(config.storage.root);
  if (config.quiet_hours) options.quiet_hours = QuietHours{config.quiet_hours->from, config.quiet_hours->to};
  options.warm_up = config.projector.warm_up;
  options.api = {.socket = config.api.socket,
                 .groups = {config.api.viewer_group, config.api.operator_group, config.api.engineer_group},
                 .http_port = config.api.http_port,
                 .http_address = config.api.http_address,
                 .tokens = config.api.tokens,
                 .proxy = config.api.proxy};
  if (config.webhook) options.webhook = HttpAddress{config.webhook->host, config.webhook->port, config.webhook->path};
  options.remote = config.safety.remote_start;
  options.guard = config.safety.guard.has_value();
  options.auto_home = config.safety.home_after_restart == config::SafetyConfig::HomeAfterRestart::guarded;
  options.manual_light = config.projector.driver == config::ProjectorConfig::Driver::manual;
  options.panel_read_time = panel_read_time(config.panel);
  options.reconstructor = reconstructor_from(config.reconstruction);
  return options;
}

}  // namespace scanrig
