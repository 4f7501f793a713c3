#include "pipeline/calibration/solve/focal_length.h"

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "pipeline/calibration/solve/unknowns.h"

namespace scanrig {
namespace {

constexpr int kMinBoards = 2;
constexpr double kMinPerspective = 1e-3;  ///< of all boards together; below it noise decides

/// Board to pixels from the image's middle, over `width`. The board over its half extent, so that all weigh alike.
std::optional<cv::Matx33d> homography(const Board& board, const BoardSight& sight, int width, int height) {
  if (sight.corners.size() < kMinCornersOfBoard) return std::nullopt;
  std::vector<cv::Point2d> places, pixels;
  const Eigen::Vector2d middle(0.5 * (width - 1), 0.5 * (height - 1));
  const double extent = 0.5 * (board.corner_columns() - 1) * board.square_mm;
  for (const CornerObservation& corner : sight.corners) {
    const Eigen::Vector2d place = ordered_corner(board, corner.id) / extent;
    const Eigen::Vector2d pixel = (corner.pixel - middle) / width;
    places.emplace_back(place.x(), place.y());
    pixels.emplace_back(pixel.x(), pixel.y());
  }
  try {
    const cv::Mat found = cv::findHomography(places, pixels);
    if (found.empty()) return std::nullopt;
    cv::Matx33d h = found;
    const double length = std::hypot(h(0, 0), h(1, 0));
    return length > 0.0 ? std::optional(h * (1.0 / length)) : std::nullopt;
  } catch (const cv::Exception&) {
    return std::nullopt;  // corners in one line
  }
}

}  // namespace

std::optional<double> find_focal_px(const Board& board, const std::vector<BoardPair>& pairs, int width, int height) {
  // Both columns of the homography are directions in space, square and of one length, once divided by f:
  // a / f^2 + b = 0.
  double aa = 0.0, ab = 0.0, bb = 0.0;
  int boards = 0;
  const auto add = [&](double a, double b) {
    aa += a * a;
    ab += a * b;
    bb += b * b;
  };
  for (const BoardPair& pair : pairs) {
    for (const BoardSight* sight : {&pair.left, &pair.right}) {
      const auto h = homography(board, *sight, width, height);
      if (!h) continue;
      const cv::Matx33d& m = *h;
      add(m(0, 0) * m(0, 1) + m(1, 0) * m(1, 1), m(2, 0) * m(2, 1));
      add(m(0, 0) * m(0, 0) + m(1, 0) * m(1, 0) - m(0, 1) * m(0, 1) - m(1, 1) * m(1, 1),
          m(2, 0) * m(2, 0) - m(2, 1) * m(2, 1));
      ++boards;
    }
  }
  if (boards < kMinBoards || !(bb > kMinPerspective * kMinPerspective) || !(ab < 0.0)) return std::nullopt;
  return width * std::sqrt(-aa / ab);
}

}  // namespace scanrig
