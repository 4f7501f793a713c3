#include "pipeline/calibration/placement/placement_aid.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "core/units.h"
#include "pipeline/calibration/corners/find_board.h"
#include "pipeline/calibration/corners/image_checks.h"

namespace scanrig {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct Sighting {
  BoardInImage image;
  std::vector<CornerObservation> corners{};
};

Sighting look(const cv::Mat& image, const std::string& pixel_format, const Board& board) {
  const auto found = find_board(image, pixel_format, board);
  if (!found) return {{.problem = found.error().message}};
  Sighting sighting{{.is_seen = true}, found->corners};
  sighting.image.outline.assign(found->outline.begin(), found->outline.end());
  for (const ImageCheck& check : check_board_image(*found, board, image.size())) {
    if (sighting.image.problem.empty() && !check.is_minor) sighting.image.problem = check.message;
  }
  return sighting;
}

std::vector<Vector2d> outline_of(const Transform& turntable_from_board, const Board& board, const Camera& camera) {
  std::vector<Vector2d> outline;
  const double right = board.columns, down = board.rows;
  for (const auto& [column, row] : {std::pair{0.0, 0.0}, {right, 0.0}, {right, down}, {0.0, down}}) {
    const Vector2d at = board.at(column, row);
    const Vector3d point = turntable_from_board * Vector3d(at.x(), at.y(), 0.0);
    if ((camera.camera_from_turntable * point).z() <= 0.0) return {};
    outline.push_back(camera.project(point));
  }
  return outline;
}

std::optional<Transform> pose_of(const Sighting& sighting, const Board& board, const Camera& camera) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const auto& corner : sighting.corners) {
    const Vector3d point = board.corner(corner.id);
    points.emplace_back(point.x(), point.y(), point.z());
    pixels.emplace_back(corner.pixel.x(), corner.pixel.y());
  }
  if (points.size() < 6) return std::nullopt;
  const auto& p = camera.projection;
  const cv::Matx33d lens(p.fx, 0.0, p.cx, 0.0, p.fy, p.cy, 0.0, 0.0, 1.0);
  const std::vector<double> distortion(camera.distortion.begin(), camera.distortion.end());
  try {
    cv::Vec3d rotation, translation;
    if (!cv::solvePnP(points, pixels, lens, distortion, rotation, translation, false, cv::SOLVEPNP_IPPE)) {
      return std::nullopt;
    }
    const Vector3d axis(rotation[0], rotation[1], rotation[2]);
    Transform camera_from_board = Transform::Identity();
    if (axis.norm() > 0.0) camera_from_board.linear() = AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix();
    camera_from_board.translation() = Vector3d(translation[0], translation[1], translation[2]);
    return camera.camera_from_turntable.inverse() * camera_from_board;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

double degrees_between(const Eigen::Matrix3d& seen, const Eigen::Matrix3d& planned, bool flat) {
  if (flat) return to_degrees(std::acos(std::clamp(seen.col(2).dot(planned.col(2)), -1.0, 1.0)));
  const Eigen::Matrix3d half_turn = AngleAxisd(M_PI, Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d off = seen.transpose() * planned;
  return to_degrees(std::min(rotation_angle(off), rotation_angle(off * half_turn)));
}

std::string side_sentence(const char* side, const BoardInImage& image) {
  if (!image.problem.empty()) return fmt::format("{}: {}", side, image.problem);
  return fmt::format("{}: board seen.", side);
}

}  // namespace

bool PlacementView::is_accepted() const {
  const bool seen = left.is_seen && right.is_seen && left.problem.empty() && right.problem.empty();
  return seen && off_deg.value_or(0.0) <= kMaxPlacementErrorDeg && off_mm.value_or(0.0) <= kMaxPlacementErrorMm;
}

Transform planned_table_from_board(const Placement& placement, const Board& board) {
  const double tilt = to_radians(placement.tilt_deg);
  const double half = 0.5 * board.square_mm * (placement.portrait ? board.columns : board.rows);
  const double floor = placement.on_block ? kBlockHeightMm : 0.0;
  const double up = floor + half * std::sin(tilt) + board.thickness_mm * std::cos(tilt);
  Eigen::Matrix3d lean;
  lean.col(0) = Vector3d::UnitX();
  lean.col(1) = Vector3d(0.0, -std::sin(tilt), std::cos(tilt));
  lean.col(2) = lean.col(0).cross(lean.col(1));
  const double turn = placement.portrait ? M_PI_2 : 0.0;
  Transform table_from_board = Transform::Identity();
  table_from_board.linear() = lean * AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
  table_from_board.translation() = Vector3d(0.0, up, placement.front_mm);
  return rot_y(to_radians(placement.mark_deg)) * table_from_board;
}

PlacementView compare_placement(const cv::Mat& left, const cv::Mat& right, const std::string& pixel_format,
                                const Board& board, const Placement& placement, const Calibration* calibration,
                                std::optional<double> table_deg) {
  auto in_left = look(left, pixel_format, board), in_right = look(right, pixel_format, board);
  PlacementView view{std::move(in_left.image), std::move(in_right.image)};
  if (!calibration || !table_deg) return view;
  const Transform planned = rot_y(to_radians(*table_deg)) * planned_table_from_board(placement, board);
  view.left.expected = outline_of(planned, board, calibration->left);
  view.right.expected = outline_of(planned, board, calibration->right);
  const bool by_left = in_left.corners.size() >= in_right.corners.size();
  const auto seen = pose_of(by_left ? in_left : in_right, board, by_left ? calibration->left : calibration->right);
  if (!seen) return view;
  view.off_mm = (seen->translation() - planned.translation()).norm();
  view.off_deg = degrees_between(seen->linear(), planned.linear(), placement.is_flat());
  return view;
}

std::string describe(const PlacementView& view) {
  if (!view.left.problem.empty() || !view.right.problem.empty() || !view.off_deg) {
    return fmt::format("{} {}", side_sentence("Left", view.left), side_sentence("Right", view.right));
  }
  return fmt::format("{:.0f} deg and {:.0f} mm off the plan: {}", *view.off_deg, *view.off_mm,
                     view.is_accepted() ? "good."
                                        : fmt::format("at most {:.0f} deg and {:.0f} mm are accepted.",
                                                      kMaxPlacementErrorDeg, kMaxPlacementErrorMm));
}

}  // namespace scanrig
