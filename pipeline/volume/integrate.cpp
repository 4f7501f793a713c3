#include "pipeline/volume/integrate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "core/heap.h"
#include "core/max_poses.h"
#include "core/parallel.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/volume/block_grid.h"
#include "pipeline/volume/distance_field.h"
#include "pipeline/volume/handles.h"
#include "pipeline/volume/hull.h"
#include "pipeline/volume/marching_cubes.h"
#include "pipeline/volume/prepare_views.h"
#include "pipeline/volume/relax.h"
#include "pipeline/volume/surface.h"

namespace scanrig {
namespace {

Result<void> check(const RangeImage& range) {
  const cv::Size size(range.projection.width, range.projection.height);
  const bool fits = range.depth.size() == size && range.sigma.size() == size && range.normal.size() == size &&
                    (range.background.empty() || range.background.size() == size);
  if (!fits) return fail(ErrorCode::invalid_input, "the matrices differ from the projection's size");
  if (!(range.projection.fx > 0.0 && range.projection.fy > 0.0)) {
    return fail(ErrorCode::invalid_input, "the focal length must be positive");
  }
  return {};
}

bool is_rigid(const Transform& transform) {
  return transform.matrix().allFinite() && (transform.linear().transpose() * transform.linear()).isIdentity(1e-6) &&
         transform.linear().determinant() > 0.0;
}

Result<void> check(std::span<const PosedViews> poses, const VolumeOptions& options) {
  const std::size_t limit = options.fusion == VolumeOptions::Fusion::paper ? 2 : kMaxPoses;
  if (poses.empty() || poses.size() > limit) {
    return fail(ErrorCode::invalid_input, "volume: 1 to {} poses can be integrated, not {}", limit, poses.size());
  }
  if (!(options.voxel_mm > 0.0) || !(options.band_mm >= 0.0)) {
    return fail(ErrorCode::invalid_input, "volume: voxel_mm must be positive and band_mm not negative, got {} and {}",
                options.voxel_mm, options.band_mm);
  }
  for (std::size_t p = 0; p < poses.size(); ++p) {
    if (!is_rigid(poses[p].model_from_pose)) {
      return fail(ErrorCode::invalid_input, "volume: pose {}: model_from_pose is not a rigid motion", p + 1);
    }
    if (!poses[p].full.empty() && poses[p].full.size() != poses[p].views.size()) {
      return fail(ErrorCode::invalid_input, "volume: pose {} has {} views, but {} range images in full", p + 1,
                  poses[p].views.size(), poses[p].full.size());
    }
    for (const auto& view : poses[p].views) {
      const bool is_elsewhere = !poses[p].full.empty() && view.range.depth.empty();
      if (auto ok = check(view.range); !ok && !is_elsewhere) {
        return pass_on(ok, fmt::format("volume: pose {}, view {}", p + 1, view.index));
      }
      for (const auto& s : view.silhouettes) {
        if (s.outside_px.size() != cv::Size(s.projection.width, s.projection.height)) {
          return fail(ErrorCode::invalid_input, "volume: pose {}, view {}: the silhouette does not have its size",
                      p + 1, view.index);
        }
      }
    }
  }
  return {};
}

bool has_silhouettes(const PosedViews& pose) {
  return std::any_of(pose.views.begin(), pose.views.end(), [](const View& v) { return !v.silhouettes.empty(); });
}

Hull make_hull(std::span<const PosedViews> poses, const VolumeOptions& options, const Eigen::AlignedBox3f& box) {
  Hull hull(box);
  for (const auto& pose : poses) {
    for (const auto& view : pose.views) {
      for (const auto& silhouette : view.silhouettes) hull.add_silhouette(silhouette, pose.model_from_pose);
    }
    if (has_silhouettes(pose) || options.table_without_silhouettes) hull.add_table(pose.model_from_pose);
  }
  return hull;
}

/// Classes in the middle of each stored block.
void count_classes(std::size_t poses, const BlockGrid& grid, VolumeReport& report) {
  report.class_counts.assign(poses, {});
  for (const auto& block : grid.blocks()) {
    for (std::size_t p = 0; p < poses; ++p) {
      if (block.classes[p]) ++report.class_counts[p][static_cast<std::size_t>(*block.classes[p])];
    }
    const auto &a = block.classes[0], &b = block.classes[1];
    if (poses == 2 && a && b) ++report.class_pairs[static_cast<std::size_t>(*a)][static_cast<std::size_t>(*b)];
    report.conflicts += block.is_in_conflict ? 1 : 0;
  }
}

/// The field's zero set, closed and repaired: its largest component.
Result<Mesh> extract(Field& field, const Eigen::AlignedBox3f& box, std::vector<Eigen::Vector3f> seeds,
                     const VolumeOptions& options, VolumeReport& report, const Context& context) {
  BlockGrid grid(box, static_cast<float>(options.voxel_mm));
  if (auto ok = grid.fill(field, std::move(seeds), context); !ok) return pass_on(ok);
  field.release();
  report.active_voxels = grid.blocks().size() * BlockGrid::kNodes;
  relax_unmeasured(grid, field.band(), options.relax_rounds);
  context.report("volume", 0.7);

  Mesh all = extract_surface(grid);
  if (all.faces.empty()) return fail(ErrorCode::degenerate, "volume: the surface encloses nothing");
  report.genus = report.genus_before_repair = genus_of_largest(all);
  if (options.repair_handles && report.genus > 0) {
    const HandleRepair repair = repair_handles(grid, all, report.genus, field.band(), options);
    report.voxels_cut = repair.cut;
    report.voxels_filled = repair.filled;
    report.genus = repair.genus;
  }
  report.dropped_components = components(all).count - 1;
  count_classes(field.poses(), grid, report);
  return largest_component(all);
}

}  // namespace

double evidence_band(std::span<const PosedViews> poses, const VolumeOptions& options) {
  if (options.band_mm > 0.0) return options.band_mm;
  std::vector<float> sigmas;
  for (const auto& pose : poses) {
    for (const auto& view : pose.views) {
      std::copy_if(view.range.sigma.begin(), view.range.sigma.end(), std::back_inserter(sigmas),
                   [](float sigma) { return !std::isnan(sigma); });
    }
  }
  if (sigmas.empty()) return options.band_voxels * options.voxel_mm;
  const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  return std::max(options.band_voxels * options.voxel_mm, options.band_sigmas * *middle);
}

Result<Surface> integrate(std::span<const PosedViews> poses, const VolumeOptions& options, const Context& context) {
  if (auto ok = check(poses, options); !ok) return pass_on(ok);
  Surface result;
  VolumeReport& report = result.report;
  report.band_mm = evidence_band(poses, options);
  context.report("volume", 0.0);
  PreparedViews prepared = prepare_views(poses, options, report.band_mm);
  if (prepared.seeds.empty()) return fail(ErrorCode::degenerate, "volume: no view measured any surface");
  if (context.stopped()) return fail(ErrorCode::stopped, "volume: stopped");

  Eigen::AlignedBox3f box = prepared.box;
  if (std::any_of(poses.begin(), poses.end(), has_silhouettes)) {
    const auto room = Eigen::Vector3f::Constant(static_cast<float>(options.hull_room_mm));
    box = {box.min() - room, box.max() + room};
  }
  auto field = std::make_unique<Field>(std::move(prepared.views_of_pose), prepared.statistics, prepared.model_from_pose,
                                       make_hull(poses, options, box), box, options, report.band_mm);
  if (!prepared.are_held) field->divide(options.memory_bytes / 2, options.max_bricks_per_axis);
  report.bricks = field->bricks().count();
  context.report("volume", 0.2);
  auto extracted = extract(*field, box, std::move(prepared.seeds), options, report, context);
  if (!extracted) return pass_on(extracted);
  result.mesh = std::move(*extracted);
  give_memory_back();  // of the blocks
  finish_surface(std::move(field), options, result.mesh);
  report.closed_vertices = static_cast<std::size_t>(std::count(result.mesh.views.begin(), result.mesh.views.end(), 0));
  report.measured_vertices = result.mesh.vertices.size() - report.closed_vertices;
  context.report("volume", 1.0);
  return result;
}

}  // namespace scanrig
