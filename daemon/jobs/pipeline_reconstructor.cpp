#include "daemon/jobs/pipeline_reconstructor.h"

#include <utility>

namespace scanrig {
namespace {

class PipelineReconstructor final : public Reconstructor {
 public:
  explicit PipelineReconstructor(Reconstruction reconstruction) : reconstruction_(std::move(reconstruction)) {}

  Result<void> add_view(std::size_t pose, const ViewImages& images, const Context& context) override {
    return reconstruction_.add_view(pose, images, context);
  }
  Result<void> finish_pose(std::size_t pose, const Context& context) override {
    return reconstruction_.finish_pose(pose, context);
  }
  Result<void> finish(const std::filesystem::path& folder, const Context& context) override {
    const auto model = reconstruction_.finish(context);
    if (!model) return pass_on(model);
    return write_model(*model, folder);
  }

 private:
  Reconstruction reconstruction_;
};

}  // namespace

ReconstructorFactory pipeline_reconstructor(ReconstructOptions options) {
  return [options = std::move(options)](const ReconstructionTask& task) -> Result<std::unique_ptr<Reconstructor>> {
    auto changed = options;
    changed.voxel_mm = task.changes.voxel_mm.value_or(options.voxel_mm);
    if (!task.changes.fusion.empty()) changed.fusion = task.changes.fusion;
    const ScanIdentity identity{.id = task.manifest.id, .profile = task.manifest.profile};
    return std::make_unique<PipelineReconstructor>(Reconstruction(task.calibration, changed, identity));
  };
}

}  // namespace scanrig
