#include "pipeline/range/disparity_range.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace scanrig {

bool find_disparities(Rectification& r, const WorkingVolume& volume) {
  double lowest = 1e9, highest = -1e9;
  constexpr int kRings = 4, kSteps = 12, kLevels = 10;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int step = 0; step < kSteps; ++step) {
      for (int level = 0; level <= kLevels; ++level) {
        const double radius = volume.radius_mm * ring / kRings, angle = to_radians(360.0 * step / kSteps);
        const Eigen::Vector3d p(radius * std::cos(angle), volume.height_mm * level / kLevels, radius * std::sin(angle));
        const Eigen::Vector3d in_left = r.left_from_turntable * p, in_right = r.right_from_turntable * p;
        if (!(in_left.z() > 1.0)) continue;
        const Eigen::Vector2d left = r.left.project(in_left), right = r.right.project(in_right);
        if (!r.left.contains(left) || !r.right.contains(right)) continue;
        lowest = std::min(lowest, left.x() - right.x());
        highest = std::max(highest, left.x() - right.x());
      }
    }
  }
  if (lowest > highest) return false;
  // The samples are coarse: widen by a little.
  r.min_disparity = static_cast<int>(std::floor(lowest)) - 8;
  r.max_disparity = static_cast<int>(std::ceil(highest)) + 8;
  return true;
}

}  // namespace scanrig
