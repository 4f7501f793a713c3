#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/range/range_image.h"
#include "pipeline/volume/class_table.h"

namespace scanrig {

/// The views of one pose and where that pose lies in the model: the identity for pose 1, pose1_from_pose2 for pose 2.
struct PosedViews {
  std::span<const View> views;
  Transform model_from_pose = Transform::Identity();
};

struct VolumeOptions {
  enum class Fusion {
    evidence,  ///< every view of every pose says surface, free or nothing; what is said is averaged
    paper      ///< a signed distance and a class a pose, two poses combined by the class table
  };
  double voxel_mm = 0.25;
  Fusion fusion = Fusion::evidence;
  double band_mm = 0.0;                    ///< half width of the zone around a surface in which it is evidence;
                                           ///< 0: three voxels, or four sigma where the data are noisier
  bool table_without_silhouettes = false;  ///< bound a pose by its plane y = 0 even if it has no silhouettes
  bool repair_handles = true;              ///< undo handles and tunnels that nothing measured supports
};

struct VolumeReport {
  double band_mm = 0.0;
  std::size_t active_voxels = 0;
  std::size_t measured_vertices = 0;
  std::size_t closed_vertices = 0;     ///< closed by the hull, the table or at the end of free space
  std::size_t dropped_components = 0;  ///< loose bits and enclosed cavities
  long genus_before_repair = 0;
  long genus = 0;
  std::size_t voxels_cut = 0;     ///< taken out of the solid to undo a handle
  std::size_t voxels_filled = 0;  ///< added to it to undo a tunnel
  /// On every fourth voxel of the active blocks: classes a pose, pairs of classes (two poses), contradictions.
  std::vector<std::array<std::size_t, kVoxelClasses>> class_counts;
  ClassPairCounts class_pairs{};
  std::size_t conflicts = 0;
};

struct Surface {
  Mesh mesh;
  VolumeReport report;
};

/// The closed surface of the object from the range images and silhouettes of one pose (a partial model) or two (the
/// complete one) [Park and Subbarao 2002, sections 2 and 4]. The mesh is one watertight component in the model's frame
/// (mm), with normals, `views` and `sigma`; same bits for any number of threads.
/// Fails with `invalid_input` (no pose or more than two, an option or a matrix that does not fit, a rotation that is
/// none), `degenerate` (no surface measured), `out_of_range` (more voxels than fit), `stopped`.
Result<Surface> integrate(std::span<const PosedViews> poses, const VolumeOptions& options = {},
                          const Context& context = {});

}  // namespace scanrig
