#include "pipeline/reconstruct/reconstruct.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/heap.h"
#include "core/max_poses.h"
#include "core/parallel.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/range/crop_view.h"
#include "pipeline/range/rectification.h"
#include "pipeline/range/view_builder.h"
#include "pipeline/reconstruct/live_mesh.h"
#include "pipeline/reconstruct/memory.h"
#include "pipeline/reconstruct/reconstruction_state.h"
#include "pipeline/reconstruct/report.h"
#include "pipeline/reconstruct/voxel_size.h"
#include "pipeline/registration/register_views.h"
#include "pipeline/texture/texture.h"
#include "pipeline/volume/integrate.h"

namespace scanrig {
namespace {

/// Voxels finer than the data only resolve the data's noise. All images of a scan come from one scanner.
double voxel_for(const RangeImage& range) {
  const bool pinhole = range.projection.kind == Projection::Kind::pinhole;
  return pinhole ? kDefaultVoxelMm : std::max(kDefaultVoxelMm, range.projection.mm_per_pixel(0.0));
}

Result<VolumeOptions::Fusion> fusion_of(const std::string& name) {
  if (name == "evidence") return VolumeOptions::Fusion::evidence;
  if (name == "paper") return VolumeOptions::Fusion::paper;
  return fail(ErrorCode::invalid_input, "fusion \"{}\" is neither \"evidence\" nor \"paper\"", name);
}

}  // namespace

Result<Reconstruction::State::PoseState*> Reconstruction::State::open_pose(std::size_t pose) {
  if (pose >= kMaxPoses) return fail(ErrorCode::invalid_input, "a scan has 1 to {} poses, not {}", kMaxPoses, pose + 1);
  if (pose > 1 && options.fusion == "paper") {
    return fail(ErrorCode::invalid_input, "fusion \"paper\" combines two poses, not {}: use \"evidence\"", pose + 1);
  }
  if (pose > poses.size()) return fail(ErrorCode::invalid_input, "pose {} has no views before pose {}", pose, pose + 1);
  if (pose == poses.size()) poses.emplace_back();
  if (poses[pose].finished) return fail(ErrorCode::invalid_input, "pose {} is finished already", pose + 1);
  return &poses[pose];
}

Result<void> Reconstruction::State::rectify_once() {
  if (rectification) return {};
  auto made = rectify(*calibration);
  if (!made) return pass_on(made, "calibration");
  rectification = std::move(*made);
  return {};
}

Result<View> Reconstruction::State::view_of(std::size_t pose, const ViewImages& images, const Context& context) const {
  const StereoImages stereo{images.left_pattern, images.right_pattern, images.left_plain, images.right_plain};
  const double gear = calibration->quality ? calibration->quality->gear : 1.0;
  auto view = make_view(*rectification, stereo, gear * images.angle_rad, images.index, {}, context);
  if (!view) return pass_on(view, fmt::format("pose {} view {}", pose + 1, images.index));
  crop_to_object_in_steps(*view, step());
  return view;
}

Result<void> Reconstruction::State::add_views(std::size_t pose, std::span<const ImageSource> sources,
                                              const Context& context) {
  auto open = open_pose(pose);
  if (!open) return pass_on(open);
  const auto mode = watch_mode_of(options.watch);
  if (!mode) return pass_on(mode);
  const bool is_alone = sources.size() == 1;
  std::vector<Result<ViewImages>> images(sources.size(), fail(ErrorCode::stopped, "stopped by request"));
  std::vector<Result<View>> views(sources.size(), fail(ErrorCode::stopped, "stopped by request"));
  {
    const StageLog::Timer timer(log, "range");
    if (auto done = rectify_once(); !done) return done;
    parallel_for(sources.size(), [&](std::size_t i) {
      if (context.stopped()) return;
      images[i] = sources[i]();
      if (images[i]) views[i] = view_of(pose, *images[i], is_alone ? context : Context{context.stop, {}});
    });
  }
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!images[i]) return pass_on(images[i]);
    if (!views[i]) return pass_on(views[i]);
  }
  for (std::size_t i = 0; i < sources.size(); ++i) take_view(**open, std::move(*views[i]), *images[i], *mode);
  return {};
}

void Reconstruction::State::set_view(PoseState& pose, std::size_t v, View view) const {
  if (step() > 1) {
    pose.full[v] = CompactRange(view.range);
    view = thinned(view, step());
  }
  pose.views[v] = std::move(view);
}

/// The views are matched already. Cameras that moved by less than refuse them leave the matches as they are, so the
/// lines of sight are intersected anew.
Result<void> Reconstruction::State::judge_rig(PoseState& pose, const Context& context) {
  if (!pose.watch) return {};
  const StageLog::Timer timer(log, "watch");
  context.report("watch", 0.0);
  const auto mode = watch_mode_of(options.watch);
  if (!mode) return pass_on(mode);
  auto judged = pose.watch->judge(pose.views, *mode);
  for (std::size_t v = 0; judged && pose.watch->is_refined() && v < pose.full.size(); ++v) {
    View whole{.range = pose.full[v].whole(), .silhouettes = {}};
    pose.watch->carry(whole, v);
    pose.full[v] = CompactRange(whole.range);
  }
  context.report("watch", 1.0);
  return judged;
}

Result<void> Reconstruction::State::finish_pose(std::size_t pose, const Context& context) {
  auto open = open_pose(pose);
  if (!open) return pass_on(open);
  PoseState& state = **open;
  if (state.views.empty()) return fail(ErrorCode::invalid_input, "pose {} has no views", pose + 1);
  if (auto done = judge_rig(state, context); !done) return pass_on(done, fmt::format("pose {}", pose + 1));
  if (auto done = register_pose(pose, context); !done) return pass_on(done, fmt::format("pose {}", pose + 1));
  const StageLog::Timer timer(log, "partial model");
  const PosedViews posed{.views = state.views};
  auto partial = integrate({&posed, 1},
                           {.voxel_mm = std::max(options.partial_voxel_mm, options.voxel_mm),
                            .denoise = std::nullopt,
                            .table_without_silhouettes = calibration.has_value(),
                            .untangle = false,
                            .memory_bytes = bytes_left()},
                           context);
  if (!partial) return pass_on(partial, fmt::format("pose {}", pose + 1));
  state.partial = std::move(*partial);
  state.pattern.clear();  // only needed to measure anew without a key, as are whole photographs
  crop_photos(state);
  state.finished = true;
  return {};
}

std::uintmax_t Reconstruction::State::bytes_left() const {
  return options.memory_bytes == std::numeric_limits<std::uintmax_t>::max() ? options.memory_bytes
                                                                            : memory_left(options.memory_bytes);
}

Result<Surface> Reconstruction::State::surface(const FoundPoses& found, const Context& context) {
  const StageLog::Timer timer(log, "integration");
  const auto fusion = fusion_of(options.fusion);
  if (!fusion) return pass_on(fusion);
  std::vector<PosedViews> posed;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!found.model_from_pose[p]) continue;
    PoseState& pose = poses[p];
    parallel_for(pose.full.size(), [&](std::size_t v) { follow_thinned(pose.full[v], pose.views[v].range, step()); });
    posed.push_back({.views = pose.views, .model_from_pose = *found.model_from_pose[p], .full = pose.full});
  }
  VolumeOptions volume{
      .voxel_mm = options.voxel_mm, .fusion = *fusion, .table_without_silhouettes = calibration.has_value()};
  if (step() > 1) {  // the images in full tell all but the band
    volume.band_mm = evidence_band(posed, volume);
    for (PoseState& pose : poses) {
      for (View& view : pose.views) release_matrices(view.range);
    }
    give_memory_back();
  }
  volume.memory_bytes = bytes_left();
  return integrate(posed, volume, context);
}

/// Colouring needs the photographs and where the views stand.
void Reconstruction::State::release_range_images() {
  for (PoseState& pose : poses) {
    for (View& view : pose.views) {
      release_matrices(view.range);
      if (!reads_again()) view.silhouettes.clear();  // else they say what is wanted of the photographs
    }
    pose.full = std::vector<CompactRange>();
  }
}

Result<void> Reconstruction::State::prepare(const Context& context) {
  if (prepared) return {};
  if (poses.empty()) return fail(ErrorCode::invalid_input, "the scan has no views");
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!poses[p].finished) return fail(ErrorCode::invalid_input, "pose {} is not finished", p + 1);
  }
  if (options.voxel_mm == 0.0) options.voxel_mm = voxel_for(poses.front().views.front().range);
  Report report(options, calibration);
  for (const PoseState& pose : poses) {
    report.add_pose(pose.views, pose.registration, pose.partial.report, pose.watch ? &*pose.watch : nullptr);
  }
  auto found = find_poses(report, context);
  if (!found) return pass_on(found);
  const bool has_pose2 = poses.size() > 1 && found->model_from_pose[0] && found->model_from_pose[1];
  if (has_pose2) report.add_next_rest(poses[0].suggested, *found->model_from_pose[1]);
  if (auto done = judge_silhouettes_of_all(*found, context); !done) return pass_on(done);
  give_memory_back();  // of the matching, or it would add to the peak
  auto integrated = surface(*found, context);
  if (!integrated) return pass_on(integrated, "integration");
  release_range_images();
  give_memory_back();
  prepared.emplace(Prepared{std::move(*found), std::move(*integrated), std::move(report)});
  return {};
}

Result<Model> Reconstruction::State::finish(const ScanIdentity& identity, const Context& context) {
  if (auto done = prepare(context); !done) return pass_on(done);
  auto& [found, surface, report] = *prepared;
  report.add_identity(identity);
  Model model;
  model.mesh.mesh = std::move(surface.mesh);
  if (auto done = add_texture(model.mesh, found, report, context); !done) return pass_on(done, "texture");
  report.add_surface(model.mesh.mesh, surface.report);
  report.add_disagreements(disagreements);
  model.report = std::make_shared<const nlohmann::json>(report.finished(log));
  return model;
}

Result<void> Reconstruction::State::add_texture(TexturedMesh& model, const FoundPoses& found, Report& report,
                                                const Context& context) {
  if (!options.texture) return {};
  const StageLog::Timer timer(log, "texture");
  const auto photographs = photos(found);
  if (!photographs) return pass_on(photographs);
  if (photographs->empty()) return {};
  std::vector<std::pair<std::size_t, int>> views;  // pose and view of every two photographs
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!found.model_from_pose[p]) continue;
    for (std::size_t v = 0; v < poses[p].plain.size(); ++v) views.emplace_back(p, poses[p].views[v].index);
  }
  auto textured = texture_mesh(model.mesh, *photographs, {}, context);
  if (!textured) return pass_on(textured);
  report.add_texture(*textured);
  for (const ContradictedPhoto& photo : textured->contradicted) {
    const auto [pose, view] = views[photo.photo / 2];
    disagreements.push_back(of_photo(pose, view, photo.photo % 2, photo));
  }
  model = std::move(textured->mesh);
  return {};
}

Reconstruction::Reconstruction(Calibration calibration, ReconstructOptions options)
    : Reconstruction(std::move(options)) {
  state_->calibration = std::move(calibration);
}

Reconstruction::Reconstruction(ReconstructOptions options) : state_(std::make_unique<State>()) {
  state_->options = std::move(options);
}

Reconstruction::~Reconstruction() = default;
Reconstruction::Reconstruction(Reconstruction&&) noexcept = default;
Reconstruction& Reconstruction::operator=(Reconstruction&&) noexcept = default;

void Reconstruction::images_are_in(std::filesystem::path scan_folder) { state_->folder = std::move(scan_folder); }

Result<void> Reconstruction::add_view(std::size_t pose, const ViewImages& images, const Context& context) {
  const ImageSource source = [&images] { return images; };
  return add_views(pose, {&source, 1}, context);
}

Result<void> Reconstruction::add_views(std::size_t pose, std::span<const ImageSource> sources, const Context& context) {
  if (!state_->calibration) return fail(ErrorCode::invalid_input, "a scan of range images takes no photographs");
  Result<void> done;
  with_threads(state_->options.threads, [&] { done = state_->add_views(pose, sources, context); });
  return done;
}

Result<void> Reconstruction::add_range_view(std::size_t pose, int index, double angle_rad, RangeImage range,
                                            const Context& /*context*/) {
  if (state_->calibration) return fail(ErrorCode::invalid_input, "a stereo scan takes no range images");
  auto open = state_->open_pose(pose);
  if (!open) return pass_on(open);
  (*open)->views.push_back({.index = index, .angle_rad = angle_rad, .range = std::move(range), .silhouettes = {}});
  return {};
}

Result<void> Reconstruction::finish_pose(std::size_t pose, const Context& context) {
  Result<void> done;
  with_threads(state_->options.threads, [&] { done = state_->finish_pose(pose, context); });
  return done;
}

Mesh Reconstruction::State::live_pose(std::size_t pose) const {
  if (!rectification || pose >= poses.size() || !poses[pose].finished) return {};
  const PoseState& state = poses[pose];
  Mesh mesh = state.partial.mesh;
  if (mesh.normals.size() != mesh.vertices.size()) mesh.normals = vertex_normals(mesh);
  const double gain = live_gain(state.views.front(), calibration->left, live_photo(pose, 0));
  colour_by_views(mesh, state.views, calibration->left, [&](std::size_t v) {
    LivePhoto photo = live_photo(pose, v);
    photo.gain = gain;
    return photo;
  });
  return mesh;
}

Mesh Reconstruction::live_view(std::size_t pose) const {
  if (!state_->rectification || pose >= state_->poses.size() || state_->poses[pose].views.empty()) return {};
  const std::vector<View>& views = state_->poses[pose].views;
  LivePhoto photo = state_->live_photo(pose, views.size() - 1);
  photo.gain = live_gain(views.front(), state_->calibration->left, state_->live_photo(pose, 0));
  return live_mesh_of_view(views.back(), state_->calibration->left, photo);
}

Mesh Reconstruction::live_pose(std::size_t pose) const { return state_->live_pose(pose); }

std::vector<PoseChoice> Reconstruction::choices() const { return state_->choices; }

std::vector<RestSuggestion> Reconstruction::suggest_rests(std::size_t pose, const Mesh& live_pose) {
  if (!state_->rectification || pose >= state_->poses.size() || !state_->poses[pose].finished) return {};
  std::vector<RestSuggestion> suggestions;
  with_threads(state_->options.threads, [&] { suggestions = state_->suggest_rests(pose, live_pose); });
  return suggestions;
}

Result<void> Reconstruction::prepare(const Context& context) {
  Result<void> done;
  with_threads(state_->options.threads, [&] { done = state_->prepare(context); });
  return done;
}

Result<Model> Reconstruction::finish(const ScanIdentity& identity, const Context& context) {
  Result<Model> model;
  with_threads(state_->options.threads, [&] { model = state_->finish(identity, context); });
  return model;
}

}  // namespace scanrig
