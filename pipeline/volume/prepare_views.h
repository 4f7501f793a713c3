#pragma once

#include <span>
#include <vector>

#include "pipeline/volume/distance_field.h"
#include "pipeline/volume/integrate.h"

namespace scanrig {

/// The views of all poses as a field takes them.
struct PreparedViews {
  std::vector<std::vector<FieldView>> views_of_pose;
  std::vector<Transform> model_from_pose;
  std::vector<Eigen::Vector3f> seeds;  ///< one measured point in about eight
  Eigen::AlignedBox3f box;             ///< of everything measured
  SurfaceStatistics statistics;
  bool are_held = true;  ///< all pixels of all views
};

/// `poses` must outlive the result. Where all pixels of all views need more than half of `options.memory_bytes` they
/// are looked at view by view, and let go.
PreparedViews prepare_views(std::span<const PosedViews> poses, const VolumeOptions& options, double band_mm);

}  // namespace scanrig
