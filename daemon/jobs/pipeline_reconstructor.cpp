#include "daemon/jobs/executors.h"

#include <tuple>
#include <utility>

#include "pipeline/model_io/model_files.h"
#include "pipeline/reconstruct/memory.h"

namespace scanrig {
namespace {

class PipelineReconstructor final : public Reconstructor {
 public:
  PipelineReconstructor(Reconstruction reconstruction, std::filesystem::path scan, int threads)
      : reconstruction_(std::move(reconstruction)), scan_(std::move(scan)), threads_(threads) {
    reconstruction_.images_are_in(scan_);
  }

  Result<void> add_view(std::size_t pose, const RawView& raw, const ViewRecord& record,
                        const Context& context) override {
    const auto images = to_view_images(raw, record);
    if (!images) return pass_on(images);
    return reconstruction_.add_view(pose, *images, context);
  }
  Result<void> finish_pose(std::size_t pose, const Context& context) override {
    return reconstruction_.finish_pose(pose, context);
  }
  std::string live_view(std::size_t pose) override { return encoded(reconstruction_.live_view(pose)); }
  std::string live_pose(std::size_t pose) override {
    Mesh mesh = reconstruction_.live_pose(pose);
    suggestions_ = reconstruction_.suggest_rests(pose, mesh);
    return encoded(std::move(mesh),
                   suggestions_.empty() ? std::nullopt : std::optional(suggestions_.front().next.turn));
  }
  std::vector<Suggestion> suggestions(std::size_t) override {
    std::vector<Suggestion> all;
    for (RestSuggestion& one : suggestions_) {
      all.push_back({{.sentence = one.sentence,
                      .doubt = one.doubt,
                      .gain = one.next.gain,
                      .unseen_after = one.next.unseen_after,
                      .overlap = one.next.overlap,
                      .has_image = !one.png.empty()},
                     std::move(one.png)});
    }
    return all;
  }
  Result<void> prepare(const Context& context) override {
    auto done = reconstruction_.prepare(context);
    // A disk that refuses them refuses what the job needs, too; the message lists them.
    if (const auto choices = reconstruction_.choices(); !choices.empty()) std::ignore = write_choices(scan_, choices);
    return done;
  }
  Result<void> finish(const std::filesystem::path& folder, const Context& context) override {
    const auto scan = ScanFolder::open(scan_);  // now that it is complete
    if (!scan) return pass_on(scan);
    if (auto prepared = prepare(context); !prepared) return prepared;
    const auto model = reconstruction_.finish(identity_of(scan->manifest()), context);
    if (!model) return pass_on(model);
    return write_model(*model, folder, threads_);
  }

 private:
  static std::string encoded(Mesh mesh, const std::optional<Eigen::Quaterniond>& other_rest = std::nullopt) {
    constexpr std::size_t kFaces = 20'000;  // 300 kB
    return encode_view_glb({.mesh = std::move(mesh), .corner_uv = {}, .atlas = {}},
                           {.max_faces = kFaces, .other_rest = other_rest})
        .value_or(std::string());
  }

  Reconstruction reconstruction_;
  std::vector<RestSuggestion> suggestions_{};  ///< of the pose that was finished last
  std::filesystem::path scan_;
  int threads_;
};

}  // namespace

ReconstructorFactory pipeline_reconstructor(ReconstructOptions options, std::uintmax_t memory_bytes) {
  return [options = std::move(options),
          memory_bytes](const ReconstructionTask& task) -> Result<std::unique_ptr<Reconstructor>> {
    auto changed = options;
    changed.voxel_mm = task.changes.voxel_mm.value_or(options.voxel_mm);
    if (!task.changes.fusion.empty()) changed.fusion = task.changes.fusion;
    changed.fixture = task.fixture;
    changed.memory_bytes = memory_bytes;
    const auto picked = picked_motion(task.folder);
    if (!picked) return pass_on(picked);
    changed.picked = *picked;
    auto fits = check_memory(task.calibration, task.views, changed.voxel_mm, memory_bytes);
    if (!fits) return pass_on(fits);
    return std::make_unique<PipelineReconstructor>(Reconstruction(task.calibration, changed), task.folder,
                                                   changed.threads);
  };
}

}  // namespace scanrig
