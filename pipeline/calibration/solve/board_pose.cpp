#include "pipeline/calibration/solve/board_pose.h"

#include <opencv2/calib3d.hpp>

#include "pipeline/calibration/solve/unknowns.h"

namespace scanrig {

std::optional<Transform> board_pose(const Board& board, const BoardSight& sight, const Projection& lens) {
  if (sight.corners.size() < kMinCornersOfBoard) return std::nullopt;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const CornerObservation& corner : sight.corners) {
    const Eigen::Vector2d place = ordered_corner(board, corner.id);
    points.emplace_back(place.x(), place.y(), 0.0);
    pixels.emplace_back(corner.pixel.x(), corner.pixel.y());
  }
  const cv::Matx33d matrix(lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0);
  try {
    cv::Vec3d turn, shift;
    if (!cv::solvePnP(points, pixels, matrix, cv::noArray(), turn, shift, false, cv::SOLVEPNP_IPPE))
      return std::nullopt;
    cv::solvePnPRefineLM(points, pixels, matrix, cv::noArray(), turn, shift);
    const Transform pose = small_motion({turn[0], turn[1], turn[2]}, {shift[0], shift[1], shift[2]});
    const bool in_front = pose.matrix().allFinite() && pose.translation().z() > 0.0;
    return in_front ? std::optional(pose) : std::nullopt;
  } catch (const cv::Exception&) {
    return std::nullopt;  // corners in one line
  }
}

}  // namespace scanrig
