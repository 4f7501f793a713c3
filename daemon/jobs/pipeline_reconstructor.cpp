#include "daemon/jobs/pipeline_reconstructor.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "pipeline/scan/model/model_files.h"

namespace scanrig {
namespace {

class PipelineReconstructor final : public Reconstructor {
 public:
  PipelineReconstructor(const Calibration& calibration, const ReconstructOptions& options)
      : reconstruction_(calibration, options) {}

  Result<void> add_view(std::size_t pose, const ViewImages& images, const Context& context) override {
    return reconstruction_.add_view(pose, images, context);
  }
  Result<void> finish_pose(std::size_t pose, const Context& context) override {
    return reconstruction_.finish_pose(pose, context);
  }
  Result<void> finish(const std::filesystem::path& folder, const Context& context) override {
    const auto model = reconstruction_.finish(context);
    if (!model) return pass_on(model);
    const auto written = write_model_files(model->mesh, model->report->dump(2), folder);
    if (!written) return pass_on(written);
    return {};
  }

 private:
  Reconstruction reconstruction_;
};

}  // namespace

ReconstructorFactory pipeline_reconstructor(ReconstructOptions options) {
  return [options = std::move(options)](const Calibration& calibration) {
    return std::make_unique<PipelineReconstructor>(calibration, options);
  };
}

}  // namespace scanrig
