#include "pipeline/reconstruct/rig_watch.h"

#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "pipeline/calibration/corners/rim_dots.h"
#include "pipeline/calibration/watch/rig_effects.h"

namespace scanrig {
namespace {

constexpr std::size_t kMinRimDots = 8;
constexpr double kBesideOutlinePx = 5.0;  // from a dot's edge: light and shadow of the object

/// The circle that find_rim_dots() searches, by the places as calibrated.
RimDots circle_of(const CalibrationQuality& quality) {
  double radius = 0.0;
  for (const Eigen::Vector3d& place : quality.rim_dots) radius += std::hypot(place.x(), place.z());
  const auto count = static_cast<int>(quality.rim_dots.size());
  return {count, radius / count, quality.rim_dot_diameter_mm};
}

/// Whether the silhouette leaves the dot free: all of it, and some around.
bool is_free(const Silhouette& silhouette, const Transform& frame_from_turntable, const Camera& camera,
             const Eigen::Vector2d& pixel, double radius_px) {
  const Eigen::Matrix3d rotation = frame_from_turntable.linear() * camera.camera_from_turntable.linear().transpose();
  const Eigen::Vector3d direction = rotation * camera.ray(pixel);
  const Eigen::Vector2d at = silhouette.projection.project(direction);
  const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
  const cv::Mat1f& outside = silhouette.outside_px;
  if (u < 0 || v < 0 || u >= outside.cols || v >= outside.rows) return true;  // the object is inside the image
  return static_cast<double>(outside(v, u)) > radius_px + kBesideOutlinePx;
}

}  // namespace

Result<WatchMode> watch_mode_of(const std::string& name) {
  if (name == "off") return WatchMode::off;
  if (name == "report") return WatchMode::report;
  if (name == "refine") return WatchMode::refine;
  return fail(ErrorCode::invalid_input, "watch \"{}\" is none of \"refine\", \"report\", \"off\"", name);
}

RigWatch::RigWatch(const Calibration& calibration, const Rectification& rectification)
    : calibration_(calibration), rectification_(rectification) {}

std::vector<DotObservation> RigWatch::find_dots(const cv::Mat& plain, const View& view, double angle_rad,
                                                std::size_t camera) const {
  const CalibrationQuality& quality = *calibration_.quality;
  if (plain.empty()) return {};
  const Camera& eye = camera == 0 ? calibration_.left : calibration_.right;
  const RimDots dots = circle_of(quality);
  RimDotOptions options;
  for (const Eigen::Vector3d& place : quality.rim_dots) {
    options.angles_rad.push_back(std::atan2(place.x(), place.z()));
  }
  auto found = find_rim_dots(plain, plain.channels() == 3 ? "BGR8" : "Mono8", eye, dots, angle_rad, options);
  if (!found) return {};
  if (camera >= view.silhouettes.size()) return std::move(found->dots);
  const Transform& frame = camera == 0 ? rectification_.left_from_turntable : rectification_.right_from_turntable;
  const double radius_px =
      0.5 * dots.diameter_mm / eye.projection.mm_per_pixel(eye.camera_from_turntable.translation().z());
  std::erase_if(found->dots, [&](const DotObservation& dot) {
    return !is_free(view.silhouettes[camera], frame, eye, dot.pixel, radius_px);
  });
  return std::move(found->dots);
}

void RigWatch::add(const ViewImages& images, const View& view) {
  if (!calibration_.quality) return;
  WatchView seen;
  seen.angle_rad = images.angle_rad;
  if (calibration_.quality->rim_dots.size() >= kMinRimDots) {
    const double angle_rad = calibration_.quality->gear * images.angle_rad;
    parallel_for(2, [&](std::size_t camera) {
      seen.dots[camera] = find_dots(camera == 0 ? images.left_plain : images.right_plain, view, angle_rad, camera);
    });
  }
  const Transform turntable_from_left = rectification_.left_from_turntable.inverse();
  for (const RowOffset& cell : view.range.row_offsets.cells) {
    seen.rows.push_back({turntable_from_left * rectification_.left.unproject(cell.u, cell.v, cell.depth),
                         cell.offset_px, cell.sigma_px});
  }
  views_.push_back(std::move(seen));
}

Result<void> RigWatch::judge(std::span<View> views, WatchMode mode) {
  result_ = watch_rig({calibration_, views_, rectification_.left_from_turntable.linear(), rectification_.left.fx});
  if (mode != WatchMode::refine) return {};
  if (result_.verdict == WatchVerdict::refused) {
    return fail(ErrorCode::below_limits, "the rig is no longer as calibrated: {}", fmt::join(result_.sentences, " "));
  }
  if (result_.verdict != WatchVerdict::moved || !result_.refined) return {};
  frames_ = carry_frames(rectification_, calibration_, *result_.refined);
  for (std::size_t v = 0; v < views.size(); ++v) carry(views[v], v);
  return {};
}

void RigWatch::carry(View& view, std::size_t v) const {
  if (frames_) retriangulate(view, rectification_, *frames_, result_.refined_angles_rad[v]);
}

void RigWatch::add_overlap(const RegistrationReport& registration) {
  scanrig::add_overlap(result_, calibration_, registration.axis_tilt_deg, registration.axis_shift_mm);
}

Transform RigWatch::left_from_turntable() const {
  return frames_ ? frames_->left_from_turntable : rectification_.left_from_turntable;
}

RegistrationOptions registration_options(const Calibration& calibration) {
  RegistrationOptions options;
  if (!calibration.quality) return options;
  const AxisSigma sigma = axis_sigma(calibration, *calibration.quality);
  options.axis_tilt_sigma_deg = std::hypot(options.axis_tilt_sigma_deg, sigma.tilt_deg);
  options.axis_shift_sigma_mm = std::hypot(options.axis_shift_sigma_mm, sigma.shift_mm);
  return options;
}

CalibrationModes calibration_modes(const Calibration& calibration, const Transform& left_from_turntable) {
  if (!calibration.quality) return {};
  const Eigen::MatrixXd& covariance = calibration.quality->cameras;
  const Eigen::VectorXd sigma =
      covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();  // each unknown has a unit of its own
  const Eigen::VectorXd scale = sigma.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * covariance * scale.asDiagonal());
  const Eigen::VectorXd spread = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd root = sigma.asDiagonal() * solver.eigenvectors() * spread.asDiagonal();
  return [=](const Transform& camera_from_pose, const Eigen::Vector3d& point) -> Eigen::Matrix3Xd {
    const Transform pose_from_turntable = camera_from_pose.inverse() * left_from_turntable;
    const Eigen::Vector3d in_turntable = pose_from_turntable.inverse() * point;
    return pose_from_turntable.linear() * (point_by_cameras(calibration, in_turntable) * root);
  };
}

}  // namespace scanrig
