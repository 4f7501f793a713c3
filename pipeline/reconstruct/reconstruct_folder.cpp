#include <algorithm>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

#include "core/max_poses.h"
#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/model_io/model_files.h"
#include "pipeline/reconstruct/memory.h"
#include "pipeline/reconstruct/reconstruct.h"

namespace scanrig {
namespace {

/// As many as are matched side by side: what keeps two cores busy, and no more images in memory than that needs.
constexpr std::size_t kSideBySide = 2;

Result<void> add_stereo_views(const ScanFolder& scan, std::size_t pose, std::size_t first, std::size_t count,
                              Reconstruction& reconstruction, const Context& context) {
  std::vector<Reconstruction::ImageSource> sources;
  for (std::size_t v = first; v < first + count; ++v) {
    sources.emplace_back([&scan, pose, v] { return scan.load_images(pose, v); });
  }
  return reconstruction.add_views(pose, sources, context);
}

Result<void> add_range_view(const ScanFolder& scan, std::size_t pose, std::size_t v, Reconstruction& reconstruction,
                            const Context& context) {
  auto range = scan.load_range(pose, v);
  if (!range) return pass_on(range);
  const ViewRecord& record = scan.manifest().poses[pose].views[v];
  return reconstruction.add_range_view(pose, record.index, to_radians(record.measured_deg), std::move(*range), context);
}

/// `at_once`: stereo views.
Result<void> add_all(const ScanFolder& scan, std::size_t pose, std::size_t at_once, Reconstruction& reconstruction,
                     const Context& context) {
  const std::size_t views = scan.manifest().poses[pose].views.size();
  const bool stereo = scan.manifest().source == "stereo";
  for (std::size_t v = 0; v < views; v += stereo ? at_once : 1) {
    if (context.stopped()) return fail(ErrorCode::stopped, "stopped by request");
    context.report("range", static_cast<double>(v) / static_cast<double>(views));
    auto added = stereo ? add_stereo_views(scan, pose, v, std::min(at_once, views - v), reconstruction, context)
                        : add_range_view(scan, pose, v, reconstruction, context);
    if (!added) return added;
  }
  return {};
}

Result<Reconstruction> begin(const ScanFolder& scan, ReconstructOptions options, std::size_t& at_once) {
  const auto picked = picked_motion(scan.path());
  if (!picked) return pass_on(picked);
  options.picked = *picked;
  if (scan.manifest().source != "stereo") return Reconstruction(options);
  auto calibration = scan.load_calibration();
  if (!calibration) return pass_on(calibration);
  std::size_t views = 0;
  for (const PoseRecord& pose : scan.manifest().poses) views += pose.views.size();
  const int count = static_cast<int>(views);
  if (auto fits = check_memory(*calibration, count, options.voxel_mm, options.memory_bytes); !fits)
    return pass_on(fits);
  at_once = views_at_once(*calibration, count, options.memory_bytes, kSideBySide);
  Reconstruction reconstruction(std::move(*calibration), options);
  reconstruction.images_are_in(scan.path());
  return reconstruction;
}

}  // namespace

ScanIdentity identity_of(const Manifest& manifest) {
  return {.id = manifest.id, .profile = manifest.profile, .config_sha256 = manifest.config_sha256};
}

Result<Model> reconstruct(const ScanFolder& scan, const ReconstructOptions& options, const Context& context) {
  const auto& poses = scan.manifest().poses;
  if (poses.empty()) return fail(ErrorCode::invalid_input, "{} has no poses", scan.path().string());
  if (poses.size() > kMaxPoses) {
    return fail(ErrorCode::invalid_input, "{}: a scan has 1 to {} poses, not {}", scan.path().string(), kMaxPoses,
                poses.size());
  }
  for (const PoseRecord& pose : poses) {
    if (!pose.complete) {
      return fail(ErrorCode::invalid_input, "{}: {} is not complete: only {} of its views were taken",
                  scan.path().string(), pose.name, pose.views.size());
    }
  }
  std::size_t at_once = 1;
  auto reconstruction = begin(scan, options, at_once);
  if (!reconstruction) return pass_on(reconstruction);
  for (std::size_t pose = 0; pose < poses.size(); ++pose) {
    if (auto added = add_all(scan, pose, at_once, *reconstruction, context); !added)
      return pass_on(added, scan.path().string());
    if (auto done = reconstruction->finish_pose(pose, context); !done) return pass_on(done, scan.path().string());
  }
  auto model = reconstruction->finish(identity_of(scan.manifest()), context);
  // Where they cannot be kept, in a folder that is only read, the message still lists them.
  if (const auto choices = reconstruction->choices(); !choices.empty())
    std::ignore = write_choices(scan.path(), choices);
  if (!model) return pass_on(model, scan.path().string());
  return model;
}

Result<void> write_model(const Model& model, const std::filesystem::path& folder, int threads) {
  const std::string report = model.report ? model.report->dump(1) + "\n" : std::string();
  Result<void> done;
  with_threads(threads, [&] {
    if (auto written = write_model_files(model.mesh, report, folder); !written) done = pass_on(written);
  });
  return done;
}

}  // namespace scanrig
