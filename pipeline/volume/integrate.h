#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/range/compact_range.h"
#include "pipeline/range/range_image.h"
#include "pipeline/volume/class_table.h"
#include "pipeline/volume/denoise.h"
#include "pipeline/volume/range_sampler.h"

namespace scanrig {

/// The views of one pose and its place in the model: the identity for pose 1, pose1_from_pose2 for pose 2.
struct PosedViews {
  std::span<const View> views;
  Transform model_from_pose = Transform::Identity();
  /// Their range images in full, where those of `views` are coarser or empty; placed as they are. Empty: those of
  /// `views`.
  std::span<const CompactRange> full{};
};

struct VolumeOptions {
  enum class Fusion {
    evidence,  ///< each view of each pose gives surface, free or nothing; the results are averaged
    paper      ///< a signed distance and a class per pose, one or two poses combined by the class table
  };
  double voxel_mm = 0.25;
  Fusion fusion = Fusion::evidence;
  RangeSamplerOptions sampler{};
  double band_voxels = 3.0;            ///< minimum of the band below
  double band_sigmas = 4.0;            ///< of the data's median sigma, where that is more
  double class_voxels = 2.0;           ///< d_TH of the paper, in voxels
  float view_sigmas = 4.0F;            ///< a point within this of a view's surface counts as measured by it
  float hull_tolerance = 0.4F;         ///< a measured surface may extend beyond the hull by this share of the band
  std::size_t images_per_outside = 5;  ///< without silhouettes a point beside one footprint in this many is outside
  double hull_room_mm = 25.0;          ///< the hull of a pose extends this far beyond its measured points
  std::size_t seed_stride = 8;         ///< one measured point in this many is a start of the surface
  int relax_rounds = 8;                ///< of a seven-point mean where unmeasured: a Gaussian of 1.5 voxels
  int smoothing_rounds = 4;            ///< of the staircases on unmeasured surface
  int scatter_rounds = 40;             ///< over which the scatter of views is averaged: six edges around
  std::optional<DenoiseOptions> denoise = DenoiseOptions{};  ///< of the measured surface
  float min_agreement = 0.5F;              ///< cosine between surface and measured normal, for moving a vertex onto it
  float doubt_reach_mm = 8.0F;             ///< the solid is doubtful this deep below a closed surface
  float max_filled_mm = 2.0F;              ///< a doubtful tunnel wider than this is not filled
  int thin_layers = 2;                     ///< solid and space are thin up to twice as many voxels
  int short_loop = 20;                     ///< voxels: a handle or tunnel with a shorter loop is not resolved if thin
  double band_mm = 0.0;                    ///< half width of the zone around a surface in which it is evidence;
                                           ///< 0: `band_voxels`, or `band_sigmas` where that is more
  bool table_without_silhouettes = false;  ///< bound a pose by its plane y = 0 even if it has no silhouettes
  bool repair_handles = true;              ///< remove handles and tunnels that no measurement supports
  bool untangle = true;                    ///< no face of the surface crosses another
  /// For what is made here, beside what the caller holds. Range images prepared for sampling take at most half of it:
  /// what needs more is done place by place, with the same bits. The floor is blocks and mesh, what one of
  /// `max_bricks_per_axis`^3 places needs, and one view.
  std::uintmax_t memory_bytes = std::numeric_limits<std::uintmax_t>::max();
  int max_bricks_per_axis = 12;
};

struct VolumeReport {
  double band_mm = 0.0;
  std::size_t active_voxels = 0;
  std::size_t bricks = 1;  ///< places, one after another
  std::size_t measured_vertices = 0;
  std::size_t closed_vertices = 0;     ///< closed by the hull, the table or at the end of free space
  std::size_t dropped_components = 0;  ///< loose pieces and enclosed cavities
  long genus_before_repair = 0;
  long genus = 0;
  std::size_t voxels_cut = 0;     ///< taken out of the solid to undo a handle
  std::size_t voxels_filled = 0;  ///< added to it to undo a tunnel
  /// On one voxel of each active block: classes per pose, pairs of classes (two poses), conflicts.
  std::vector<std::array<std::size_t, kVoxelClasses>> class_counts;
  ClassPairCounts class_pairs{};
  std::size_t conflicts = 0;
};

struct Surface {
  Mesh mesh;
  VolumeReport report;
};

/// Half width of the zone around a surface in which it is evidence, mm, from the sigmas of the views' own range images:
/// for `VolumeOptions::band_mm`, where these are released before the integration of those in full.
double evidence_band(std::span<const PosedViews> poses, const VolumeOptions& options = {});

/// The closed surface of the object from the range images and silhouettes of one pose (a partial model) or more (the
/// complete one) [Park and Subbarao 2002, sections 2 and 4]. The mesh is one watertight component in the model's frame
/// (mm), with normals, `views` and `sigma`; same bits for any number of threads.
/// Fails with `invalid_input` (no pose or too many, an unsuitable option or matrix, not a rotation matrix),
/// `degenerate` (no surface measured), `out_of_range` (too many voxels), `stopped`.
Result<Surface> integrate(std::span<const PosedViews> poses, const VolumeOptions& options = {},
                          const Context& context = {});

}  // namespace scanrig
