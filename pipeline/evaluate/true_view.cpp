#include "pipeline/evaluate/true_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig {
namespace {

/// A segment starts this far off the surface, mm, so that its own face does not block it.
constexpr double kLift = 0.01;

/// The pixels that can show the mesh, and a rim around them.
cv::Rect frame_of(const Mesh& mesh, const Camera& camera) {
  Eigen::Array2d low = Eigen::Array2d::Constant(1e6), high = -low;
  for (const auto& vertex : mesh.vertices) {
    const Eigen::Vector3d p = vertex.cast<double>();
    if ((camera.camera_from_turntable * p).z() <= 1.0) continue;
    const Eigen::Array2d px = camera.project(p).array();
    low = low.min(px);
    high = high.max(px);
  }
  low = (low - 12.0).max(-1e6);
  high = (high + 12.0).min(1e6);
  const cv::Rect box(cv::Point(static_cast<int>(low.x()), static_cast<int>(low.y())),
                     cv::Point(static_cast<int>(high.x()), static_cast<int>(high.y())));
  return box & cv::Rect(0, 0, camera.projection.width, camera.projection.height);
}

/// 255 at pixels beside a jump of depth, on both of its sides.
cv::Mat1b jumps(const cv::Mat1f& depth, double jump) {
  cv::Mat1b found(depth.size(), uchar{0});
  const auto compare = [&](int r, int c, int r2, int c2) {
    const float a = depth(r, c), b = depth(r2, c2);
    if (a == b || std::abs(a - b) <= jump) return;
    found(r, c) = found(r2, c2) = 255;
  };
  for (int r = 0; r < depth.rows; ++r) {
    for (int c = 0; c < depth.cols; ++c) {
      if (c + 1 < depth.cols) compare(r, c, r, c + 1);
      if (r + 1 < depth.rows) compare(r, c, r + 1, c);
    }
  }
  return found;
}

}  // namespace

Eigen::Vector2d undistort(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Projection& p = camera.projection;
  const Eigen::Vector2d distorted((pixel.x() - p.cx) / p.fx, (pixel.y() - p.cy) / p.fy);
  if (camera.distortion == decltype(camera.distortion){} && !camera.lens_field) return distorted;
  Camera plain = camera;
  plain.camera_from_turntable = Transform::Identity();
  Eigen::Vector2d x = distorted;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d px = plain.project({x.x(), x.y(), 1.0});
    const Eigen::Vector2d step((pixel.x() - px.x()) / p.fx, (pixel.y() - px.y()) / p.fy);
    x += step;
    if (step.norm() < 1e-12) break;
  }
  return x;
}

TrueView::TrueView(const Truth& truth, const SurfaceIndex& surface, const TruePose& pose, double angle_deg,
                   const ObservableRule& rule)
    : truth_(truth),
      surface_(surface),
      rule_(rule),
      table_from_truth_(rot_y(to_radians(angle_deg)) * pose.table_from_truth),
      left_(look(truth.left)),
      right_(look(truth.right)),
      projector_((truth.projector_from_turntable * table_from_truth_).inverse().translation()) {}

TrueImage TrueView::look(Camera camera) const {
  const Transform table_from_camera = camera.camera_from_turntable.inverse();
  camera.camera_from_turntable = camera.camera_from_turntable * table_from_truth_;
  const Transform truth_from_camera = camera.camera_from_turntable.inverse();
  TrueImage image;
  image.camera = camera;
  image.centre = truth_from_camera.translation();
  const cv::Size size(camera.projection.width, camera.projection.height);
  image.depth = cv::Mat1f(size, std::numeric_limits<float>::infinity());
  image.face = cv::Mat1i(size, -1);
  const cv::Rect frame = frame_of(truth_.mesh, camera);
  parallel_for(static_cast<std::size_t>(frame.height), [&](std::size_t i) {
    const int row = frame.y + static_cast<int>(i);
    for (int col = frame.x; col < frame.x + frame.width; ++col) {
      const Eigen::Vector3d ray = undistort(camera, {col, row}).homogeneous();
      const auto hit = surface_.first_hit(image.centre, truth_from_camera.linear() * ray);
      if (hit) {
        image.depth(row, col) = static_cast<float>(hit->distance);
        image.face(row, col) = static_cast<int>(hit->face);
      }
      const Eigen::Vector3d down = table_from_camera.linear() * ray;
      const double table = -table_from_camera.translation().y() / down.y();
      const Eigen::Vector3d on_table = table_from_camera.translation() + table * down;
      const bool shows = table > 0.0 && std::hypot(on_table.x(), on_table.z()) < truth_.table_radius_mm;
      if (shows && table < image.depth(row, col)) {
        image.depth(row, col) = static_cast<float>(table);
        image.face(row, col) = -1;
      }
    }
  });
  image.near_jump.create(size);
  image.near_jump = uchar{0};
  const int reach = 2 * rule_.jump_distance_px + 1;
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {reach, reach});
  cv::Mat1b dilated;
  cv::dilate(jumps(image.depth(frame), rule_.depth_jump_mm), dilated, disc);
  dilated.copyTo(image.near_jump(frame));
  return image;
}

bool TrueView::table_blocks(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::Vector3d a = table_from_truth_ * from, b = table_from_truth_ * to;
  if ((a.y() > 0.0) == (b.y() > 0.0)) return false;
  const Eigen::Vector3d crossing = a + (b - a) * (a.y() / (a.y() - b.y()));
  return std::hypot(crossing.x(), crossing.z()) < truth_.table_radius_mm;
}

bool TrueView::observes(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
  if ((table_from_truth_ * point).y() < rule_.min_height_mm) return false;
  const double min_cosine = std::cos(to_radians(rule_.max_incidence_deg));
  for (const Eigen::Vector3d& centre : {left_.centre, right_.centre, projector_}) {
    if ((centre - point).normalized().dot(normal) < min_cosine) return false;
  }
  for (const TrueImage* image : {&left_, &right_}) {
    const Eigen::Vector2d px = image->camera.project(point);
    if (!image->camera.projection.contains(px, rule_.margin_px)) return false;
    const cv::Point nearest(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
    if (image->near_jump(nearest) != 0) return false;
  }
  const Eigen::Vector3d start = point + kLift * normal;
  for (const Eigen::Vector3d& centre : {left_.centre, right_.centre, projector_}) {
    if (table_blocks(start, centre) || surface_.blocked(start, centre)) return false;
  }
  return true;
}

}  // namespace scanrig
