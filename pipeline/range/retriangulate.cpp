#include "pipeline/range/retriangulate.h"

#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace scanrig {

MovedFrames carry_frames(const Rectification& rectification, const Calibration& was, const Calibration& is) {
  const auto carried = [](const Transform& frame_from_turntable, const Camera& before, const Camera& after) {
    return frame_from_turntable * before.camera_from_turntable.inverse() * after.camera_from_turntable;
  };
  return {carried(rectification.left_from_turntable, was.left, is.left),
          carried(rectification.right_from_turntable, was.right, is.right)};
}

void retriangulate(View& view, const Rectification& rectification, const MovedFrames& frames, double angle_rad) {
  RangeImage& range = view.range;
  const Transform right_from_left = frames.right_from_turntable * frames.left_from_turntable.inverse();
  const Eigen::Vector3d shift = right_from_left.translation();
  parallel_for(static_cast<std::size_t>(range.depth.rows), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < range.depth.cols; ++u) {
      const double depth = static_cast<double>(range.depth(v, u));
      if (std::isnan(depth)) continue;
      const Eigen::Vector3d ray = range.projection.unproject(u, v, 1.0);
      const double there = ray.x() - rectification.baseline_mm / depth;  // x / z in the right image, as matched
      const Eigen::Vector3d turned = right_from_left.linear() * ray;
      const double moved = (there * shift.z() - shift.x()) / (turned.x() - there * turned.z());
      range.depth(v, u) = static_cast<float>(moved);
      range.sigma(v, u) *= static_cast<float>((moved / depth) * (moved / depth));
    }
  });
  view.angle_rad = angle_rad;
  range.camera_from_pose = frames.left_from_turntable * rot_y(angle_rad);
  if (!view.silhouettes.empty()) view.silhouettes.front().camera_from_pose = range.camera_from_pose;
  if (view.silhouettes.size() > 1) {
    view.silhouettes[1].camera_from_pose = frames.right_from_turntable * rot_y(angle_rad);
  }
}

}  // namespace scanrig
