#include "daemon/options_from.h"

#include "daemon/jobs/pipeline_reconstructor.h"

namespace scanrig {

DaemonOptions options_from(const config::RigConfig& config) {
  const auto& recipe = config.recipes.at("default");
  DaemonOptions options;
  options.jobs = {.root = config.storage.root,
                  .calibration_file = config.calibration_file,
                  .profile = "",
                  .poses = recipe.poses,
                  .views = recipe.views};
  options.api = {.socket = config.api.socket,
                 .groups = {config.api.viewer_group, config.api.operator_group, config.api.engineer_group},
                 .http_port = config.api.http_port,
                 .http_address = config.api.http_address,
                 .tokens = config.api.tokens};
  options.remote = config.safety.remote_start;
  options.guard = config.safety.guard.has_value();
  options.home_guarded = config.safety.home_after_restart == config::SafetyConfig::HomeAfterRestart::guarded;
  options.manual_light = config.projector.driver == config::ProjectorConfig::Driver::manual;
  ReconstructOptions reconstruct;
  reconstruct.voxel_mm = config.reconstruction.voxel_mm;
  options.reconstructor = pipeline_reconstructor(reconstruct);
  return options;
}

}  // namespace scanrig
