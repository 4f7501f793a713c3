#include "tests/unit/pipeline/calibration/watch/watched_rig.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "core/units.h"

namespace scanrig::test {
namespace {

constexpr double kDotRadius = 84.5;
const Eigen::Vector3d kAim(0, 45, 0);

Camera looking(const Eigen::Vector3d& from) {
  Camera camera;
  camera.projection = {Projection::Kind::pinhole, 1280, 960, 4266.7, 4266.7, 639.5, 479.5};
  camera.distortion = {-0.03, 0.05, 1e-4, -1e-4, 0.0};
  const Eigen::Vector3d z = (kAim - from).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d axes;
  axes.row(0) = x;
  axes.row(1) = z.cross(x);
  axes.row(2) = z;
  camera.camera_from_turntable.linear() = axes;
  camera.camera_from_turntable.translation() = -(axes * from);
  return camera;
}

/// Of a calibration of grade A: 3 um of volume, by 0.001 px of turn and 0.6 um of place; scale known to 1e-4.
Eigen::MatrixXd covariance(const Calibration& calibration) {
  Eigen::MatrixXd cov = Eigen::MatrixXd::Zero(30, 30);
  for (int c = 0; c < 2; ++c) {
    cov.diagonal().segment<3>(15 * c + 9).setConstant(std::pow(0.001 * kPixel, 2));
    cov.diagonal().segment<3>(15 * c + 12).setConstant(std::pow(0.0006, 2));
  }
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(30);
  scale.segment<3>(12) = calibration.left.camera_from_turntable.translation();
  scale.segment<3>(27) = calibration.right.camera_from_turntable.translation();
  return cov + 1e-8 * scale * scale.transpose();
}

void turn(Camera& camera, const Eigen::Vector3d& rotation) {
  camera.camera_from_turntable = small_motion(rotation, Eigen::Vector3d::Zero()) * camera.camera_from_turntable;
}

Eigen::Vector3d triangulated(const Calibration& calibration, const Eigen::Vector2d& left,
                             const Eigen::Vector2d& right) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [camera, pixel] : {std::pair(&calibration.left, left), std::pair(&calibration.right, right)}) {
    const Transform table_from_camera = camera->camera_from_turntable.inverse();
    const Eigen::Vector3d along = (table_from_camera.linear() * camera->ray(pixel)).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along * along.transpose();
    normal += across;
    sum += across * table_from_camera.translation();
  }
  return normal.ldlt().solve(sum);
}

Eigen::Matrix3d rectified_axes(const Calibration& calibration) {
  const Transform left = calibration.left.camera_from_turntable, right = calibration.right.camera_from_turntable;
  const Eigen::Vector3d x = (right.inverse().translation() - left.inverse().translation()).normalized();
  const Eigen::Vector3d sight = (left.linear().row(2) + right.linear().row(2)).transpose();
  Eigen::Matrix3d axes;
  axes.row(0) = x;
  axes.row(2) = (sight - x * x.dot(sight)).normalized();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return axes;
}

/// v_right - v_left of a point in the images as `known` rectifies them and the true cameras show them.
double row_offset(const Calibration& known, const Calibration& truth, const Eigen::Vector3d& point) {
  const Eigen::Matrix3d axes = rectified_axes(known);
  const auto row = [&](const Camera& was, const Camera& is) {
    const Eigen::Vector3d seen = axes * was.camera_from_turntable.linear().transpose() * was.ray(is.project(point));
    return 4266.7 * seen.y() / seen.z();
  };
  return row(known.right, truth.right) - row(known.left, truth.left);
}

/// The side of an upright cylinder that the cameras see.
std::vector<Eigen::Vector3d> object_points() {
  std::vector<Eigen::Vector3d> points;
  for (const double height : {10.0, 35.0, 60.0, 85.0}) {
    for (const double angle : {-0.9, -0.3, 0.3, 0.9}) {
      points.emplace_back(30.0 * std::sin(angle), height, 30.0 * std::cos(angle));
    }
  }
  return points;
}

}  // namespace

WatchedRig::WatchedRig(const RigChange& change, unsigned seed) : random_(seed), change_(change) {
  const Eigen::Vector3d centre =
      kAim + 640.0 * Eigen::Vector3d(0, std::sin(to_radians(22.0)), std::cos(to_radians(22.0)));
  calibration_.left = looking(centre - Eigen::Vector3d(80, 0, 0));
  calibration_.right = looking(centre + Eigen::Vector3d(80, 0, 0));
  calibration_.table_radius_mm = 90.0;
  CalibrationQuality quality;
  quality.grade = "A";
  quality.cameras = covariance(calibration_);
  quality.rim_dot_diameter_mm = 2.4;
  for (int i = 0; i < 40; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 40;
    true_dots_.emplace_back(kDotRadius * std::sin(angle) + gauss(0.03), gauss(0.01),
                            kDotRadius * std::cos(angle) + gauss(0.03));
    quality.rim_dots.push_back(true_dots_.back() + Eigen::Vector3d(gauss(0.0015), gauss(0.0015), gauss(0.0015)));
  }
  calibration_.quality = quality;
  truth_ = calibration_;
  const Transform table = small_motion(change.table_tilt, change.table_shift);
  for (Camera* camera : {&truth_.left, &truth_.right}) {
    camera->camera_from_turntable = camera->camera_from_turntable * table;
  }
  turn(truth_.left, change.left_turn);
  turn(truth_.right, change.right_turn);
}

void WatchedRig::see_dots(WatchView& view, double angle_rad) {
  for (int c = 0; c < 2; ++c) {
    const Camera& camera = c == 0 ? truth_.left : truth_.right;
    const Eigen::Vector2d common(gauss(0.004), gauss(0.004));
    for (int id = 0; id < static_cast<int>(true_dots_.size()); ++id) {
      const Eigen::Vector3d place = rot_y(angle_rad) * true_dots_[static_cast<std::size_t>(id)];
      if (place.z() < 0.0 && std::abs(place.x()) < 43.0) continue;  // behind the object
      const Eigen::Vector2d noise(gauss(0.04), gauss(0.02));
      view.dots[static_cast<std::size_t>(c)].push_back({id, camera.project(place) + common + noise});
    }
  }
}

void WatchedRig::see_rows(WatchView& view) {
  const double common = gauss(0.003);
  for (const Eigen::Vector3d& point : object_points()) {
    view.rows.push_back({point, row_offset(calibration_, truth_, point) + common + gauss(0.004), 0.004});
  }
}

WatchInput WatchedRig::observe(int views) {
  WatchInput input{calibration_, {}, rectified_axes(calibration_), 4266.7};
  for (int k = 0; k < views; ++k) {
    WatchView view;
    view.angle_rad = 2.0 * std::numbers::pi * k / views;
    see_dots(view, view.angle_rad + to_radians(change_.table_zero_deg + k * change_.angle_step_deg + gauss(0.002)));
    see_rows(view);
    input.views.push_back(view);
  }
  return input;
}

double WatchedRig::volume_error_um(const Calibration& calibration) const {
  std::vector<Eigen::Vector3d> errors;
  double height = 0.0;
  for (int level = 0; level < 6; ++level) {
    for (int step = 0; step < 13; ++step) {
      const double radius = step == 0 ? 0.0 : step < 7 ? 27.5 : 55.0, angle = step * std::numbers::pi / 3.0;
      const Eigen::Vector3d p(radius * std::cos(angle), 2.0 + 22.0 * level, radius * std::sin(angle));
      errors.push_back(triangulated(calibration, truth_.left.project(p), truth_.right.project(p)) - p);
      height += errors.back().y();
    }
  }
  height /= static_cast<double>(errors.size());
  double squares = 0.0;
  for (const auto& error : errors) squares += (error - Eigen::Vector3d(0.0, height, 0.0)).squaredNorm();
  return 1e3 * std::sqrt(squares / static_cast<double>(errors.size()));
}

double WatchedRig::row_error_px(const Calibration& calibration) const {
  double squares = 0.0;
  for (const auto& point : object_points()) squares += std::pow(row_offset(calibration, truth_, point), 2);
  return std::sqrt(squares / static_cast<double>(object_points().size()));
}

}  // namespace scanrig::test
