#include "tests/bench/pose/campaign_rig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/units.h"
#include "pipeline/pose/rig_sight.h"
#include "pipeline/range/crop_view.h"
#include "tests/bench/pose/depth_steps.h"

namespace scanrig::campaign {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kImageScale = 0.4;  // of 1280 x 960
constexpr double kFullFocalPx = 4266.7, kDistanceMm = 640.0, kAimHeightMm = 45.0, kBaselineMm = 160.0;
constexpr double kElevationDeg = 22.0;

// Of a good calibration, standard deviations; shared/design: calibration.
constexpr double kAxisTiltDeg = 0.002, kAxisShiftMm = 0.003, kHeightMm = 0.005;
constexpr double kBaselineSigmaMm = 0.004, kTurnSigmaRad = 3e-6;

// Of the range stage at full resolution: StereoOptions and docs/measured.
constexpr double kDisparitySigmaPx = 0.02;  // of matches on good texture
constexpr double kTextureSpread = 0.35;     // log of its scatter over the surface
constexpr double kTiltPx = 0.6;             // StereoOptions::tilt
constexpr double kWindowPx = 6.0;           // half width of a window
constexpr double kNoiseSigmaPx = 3.0;       // of a Gaussian as wide as a window
constexpr double kTextureSigmaPx = 25.0;
constexpr double kMaxIncidenceDeg = 72.0;
constexpr double kStepMm = 1.3;  // some 2 px of disparity at full resolution
constexpr int kLostBesideStepPx = 2;
constexpr double kSpotSigmas = 2.6;  // spots without a match: 0.5 % of the surface
constexpr int kMinNormalPixels = 9;
constexpr int kMarkStridePx = 8;

Calibration true_rig() {
  const double elevation = to_radians(kElevationDeg);
  const Vector3d aim(0, kAimHeightMm, 0), away(0, std::sin(elevation), std::cos(elevation));
  Calibration calibration;
  for (const bool is_left : {true, false}) {
    Camera& camera = is_left ? calibration.left : calibration.right;
    const double aside = is_left ? -0.5 * kBaselineMm : 0.5 * kBaselineMm;
    const Vector3d centre = aim + kDistanceMm * away + aside * Vector3d::UnitX();
    const Vector3d right = Vector3d::UnitX();
    camera.camera_from_turntable.linear() << right.transpose(), (-away).cross(right).transpose(), -away.transpose();
    camera.camera_from_turntable.translation() = -camera.camera_from_turntable.linear() * centre;
    Projection& p = camera.projection;
    p.width = static_cast<int>(1280 * kImageScale);
    p.height = static_cast<int>(960 * kImageScale);
    p.fx = p.fy = kFullFocalPx * kImageScale;
    p.cx = 0.5 * (p.width - 1) + p.fx * aside / kDistanceMm;  // both look at the aim: parallel, shifted
    p.cy = 0.5 * (p.height - 1);
  }
  calibration.table_radius_mm = 90.0;
  return calibration;
}

using CameraUnknowns = Eigen::Matrix<double, 30, 1>;

/// Of both cameras' unknowns, see CalibrationQuality: the table as both see it, and the right camera beside the left.
Eigen::Matrix<double, 30, 9> calibration_modes(const Calibration& rig) {
  constexpr int kTurn = 9, kShift = 12, kCamera = 15;
  Eigen::Matrix<double, 30, 9> modes = Eigen::Matrix<double, 30, 9>::Zero();
  for (int camera = 0; camera < 2; ++camera) {
    const Transform& pose = (camera == 0 ? rig.left : rig.right).camera_from_turntable;
    for (const auto& [mode, axis] : {std::pair{0, 0}, {1, 2}}) {  // tilts leave the table's middle
      modes.block<3, 1>(kCamera * camera + kTurn, mode) = to_radians(kAxisTiltDeg) * pose.linear().col(axis);
    }
    for (const auto& [mode, axis, mm] : {std::tuple{2, 0, kAxisShiftMm}, {3, 2, kAxisShiftMm}, {4, 1, kHeightMm}}) {
      modes.block<3, 1>(kCamera * camera + kShift, mode) = mm * pose.linear().col(axis);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    modes.block<3, 1>(kCamera + kTurn, 5 + axis) = kTurnSigmaRad * Vector3d::Unit(axis);
    // The right camera turns about its own centre.
    modes.block<3, 1>(kCamera + kShift, 5 + axis) =
        (kTurnSigmaRad * Vector3d::Unit(axis)).cross(rig.right.camera_from_turntable.translation());
  }
  modes(kCamera + kShift, 8) = kBaselineSigmaMm;
  return modes;
}

void move(Camera& camera, const Eigen::Matrix<double, 6, 1>& change) {
  Transform& pose = camera.camera_from_turntable;
  pose.linear() = small_motion(change.head<3>(), Vector3d::Zero()).linear() * pose.linear();
  pose.translation() += change.tail<3>();
}

/// White noise through a Gaussian, standard deviation 1.
cv::Mat1f smooth_noise(cv::Size size, double sigma_px, Chance& chance) {
  cv::Mat1f noise(size);
  for (float& value : noise) value = static_cast<float>(chance.between(-1.732, 1.732));
  cv::GaussianBlur(noise, noise, {}, sigma_px, sigma_px, cv::BORDER_REFLECT);
  noise *= 2.0 * sigma_px * std::sqrt(std::numbers::pi);
  return noise;
}

/// The object in one camera.
struct Sight {
  cv::Rect box;  ///< that holds it
  cv::Mat1f depth;
  cv::Mat1i face;  ///< -1: background
};

Sight look(const Placed& placed, const Camera& camera, const Transform& camera_from_pose) {
  const Transform camera_from_object = camera_from_pose * placed.pose_from_object;
  const Transform object_from_camera = camera_from_object.inverse();
  const cv::Rect all(0, 0, camera.projection.width, camera.projection.height);
  Eigen::AlignedBox2d around;
  for (const Eigen::Vector3f& v : placed.mesh.vertices) {
    around.extend(camera.projection.project(camera_from_object * v.cast<double>()));
  }
  const cv::Point low(static_cast<int>(around.min().x()) - 1, static_cast<int>(around.min().y()) - 1);
  const cv::Point high(static_cast<int>(around.max().x()) + 3, static_cast<int>(around.max().y()) + 3);
  Sight sight{cv::Rect(low, high) & all, cv::Mat1f(all.size(), kUnmeasured), cv::Mat1i(all.size(), -1)};
  for (int v = sight.box.y; v < sight.box.br().y; ++v) {
    for (int u = sight.box.x; u < sight.box.br().x; ++u) {
      const Vector3d ray = object_from_camera.linear() * camera.projection.unproject(u, v, 1.0);
      const auto hit = placed.surface.first_hit(object_from_camera.translation(), ray);
      if (!hit) continue;
      sight.depth(v, u) = static_cast<float>(hit->distance);
      sight.face(v, u) = static_cast<int>(hit->face);
    }
  }
  return sight;
}

Vector3d face_normal(const Mesh& mesh, int face) {
  const Mesh::Face& f = mesh.faces[static_cast<std::size_t>(face)];
  const Vector3d a = mesh.vertices[f[0]].cast<double>();
  return (mesh.vertices[f[1]].cast<double>() - a).cross(mesh.vertices[f[2]].cast<double>() - a).normalized();
}

/// Signed distance to the outline of what is 255, in pixels, positive outside.
cv::Mat1f outline_distance(const cv::Mat1i& face) {
  cv::Mat1b inside;
  cv::compare(face, 0, inside, cv::CMP_GE);
  cv::Mat1f to_inside, to_outside, signed_px;
  cv::distanceTransform(255 - inside, to_inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(inside, to_outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::subtract(to_inside, to_outside, signed_px);
  for (float& d : signed_px) d += d > 0.0F ? -0.5F : 0.5F;
  return signed_px;
}

/// Depth in the calibrated left camera of what the true cameras show in these pixels.
double triangulated(const Rig& rig, double u, double v, double true_depth) {
  const Vector3d in_left = rig.truth.left.projection.unproject(u, v, true_depth);
  const Vector3d in_right =
      rig.truth.right.camera_from_turntable * (rig.truth.left.camera_from_turntable.inverse() * in_left);
  const double right_x = rig.truth.right.projection.project(in_right).x();
  const Transform right_from_left =
      rig.calibration.right.camera_from_turntable * rig.calibration.left.camera_from_turntable.inverse();
  const Projection& p = rig.calibration.right.projection;
  const Vector3d ray = right_from_left.linear() * rig.calibration.left.projection.unproject(u, v, 1.0);
  const Vector3d& start = right_from_left.translation();
  const double x = (right_x - p.cx) / p.fx;
  return (x * start.z() - start.x()) / (ray.x() - x * ray.z());
}

/// Standard deviation of a depth: disparities that steep surface makes worse.
double depth_sigma(const Projection& p, const Vector3d& point, const Vector3d& normal, double texture) {
  const double reach = normal.dot(point);  // of the plane from the camera, < 0
  const double across = kBaselineMm * normal.x() / reach, down = kBaselineMm * normal.y() / reach;
  const double disparity_px = p.fx / kImageScale * kBaselineMm / point.z();
  return point.z() / disparity_px * kDisparitySigmaPx * texture * std::hypot(1.0, across / kTiltPx, down / kTiltPx);
}

/// Tangent planes of the windows around each pixel, as matching finds them.
void add_normals(RangeImage& range, const cv::Rect& box) {
  const int reach = static_cast<int>(std::lround(kWindowPx * kImageScale));
  const Projection& p = range.projection;
  cv::Mat1f depth = range.depth.clone();
  for (int v = box.y; v < box.br().y; ++v) {
    for (int u = box.x; u < box.br().x; ++u) {
      const float middle = depth(v, u);
      if (std::isnan(middle)) continue;
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Vector3d right = Vector3d::Zero();
      int count = 0;
      for (int y = std::max(v - reach, 0); y <= std::min(v + reach, depth.rows - 1); ++y) {
        for (int x = std::max(u - reach, 0); x <= std::min(u + reach, depth.cols - 1); ++x) {
          const float z = depth(y, x);
          if (!(std::abs(z - middle) < 6.0F)) continue;
          const Vector3d row(1.0, x - u, y - v);
          normal += row * row.transpose();
          right += static_cast<double>(z - middle) * row;
          ++count;
        }
      }
      const Vector3d plane = count >= kMinNormalPixels ? Vector3d(normal.ldlt().solve(right)) : Vector3d::Zero();
      const double z = middle;
      const Vector3d along_u(z / p.fx + (u - p.cx) / p.fx * plane[1], (v - p.cy) / p.fy * plane[1], plane[1]);
      const Vector3d along_v((u - p.cx) / p.fx * plane[2], z / p.fy + (v - p.cy) / p.fy * plane[2], plane[2]);
      const Eigen::Vector3f n = along_v.cross(along_u).normalized().cast<float>();
      if (count < kMinNormalPixels || !n.allFinite()) {
        range.depth(v, u) = range.sigma(v, u) = kUnmeasured;
        continue;
      }
      range.normal(v, u) = cv::Vec3f(n.x(), n.y(), n.z());
    }
  }
}

struct TableAngle {
  double real_rad = 0.0, reported_rad = 0.0;
};

/// Range image: depths with noise, where both cameras and the projector see the surface.
void measure(const Placed& placed, const Rig& rig, const TableAngle& angle, const Sight& sight, View& view,
             std::vector<Mark>& marks, Chance& chance) {
  RangeImage& range = view.range;
  const RigEyes eyes = rig_eyes(rig.truth);
  const Transform object_from_turntable = (rot_y(angle.real_rad) * placed.pose_from_object).inverse();
  const Transform camera_from_object = rig.truth.left.camera_from_turntable * object_from_turntable.inverse();
  const Transform object_from_camera = camera_from_object.inverse();
  const std::array<Vector3d, 3> at = {
      object_from_turntable * rig.truth.left.camera_from_turntable.inverse().translation(),
      object_from_turntable * rig.truth.right.camera_from_turntable.inverse().translation(),
      object_from_turntable * eyes.projector};
  const cv::Mat1b lost = beside_steps(sight.depth, kStepMm, kLostBesideStepPx);
  const cv::Mat1f noise = smooth_noise(lost.size(), kNoiseSigmaPx * kImageScale, chance);
  const cv::Mat1f texture = smooth_noise(lost.size(), kTextureSigmaPx * kImageScale, chance);
  const cv::Mat1f spots = smooth_noise(lost.size(), 2.0 * kNoiseSigmaPx * kImageScale, chance);
  const double min_cosine = std::cos(to_radians(kMaxIncidenceDeg));
  const Projection& p = rig.truth.left.projection;
  for (int v = sight.box.y; v < sight.box.br().y; ++v) {
    for (int u = sight.box.x; u < sight.box.br().x; ++u) {
      if (sight.face(v, u) < 0 || lost(v, u) != 0 || static_cast<double>(spots(v, u)) > kSpotSigmas) continue;
      const Vector3d normal = face_normal(placed.mesh, sight.face(v, u));
      const Vector3d in_camera = p.unproject(u, v, sight.depth(v, u));
      const Vector3d point = object_from_camera * in_camera;
      const bool is_measured = std::ranges::all_of(at, [&](const Vector3d& eye) {
        return (eye - point).normalized().dot(normal) > min_cosine &&
               !placed.surface.blocked(point + 0.02 * normal, eye);
      });
      if (!is_measured) continue;
      const double sigma = depth_sigma(p, in_camera, camera_from_object.linear() * normal,
                                       std::exp(kTextureSpread * static_cast<double>(texture(v, u))));
      const double depth = in_camera.z() + sigma * static_cast<double>(noise(v, u));
      range.depth(v, u) = static_cast<float>(triangulated(rig, u, v, depth));
      range.sigma(v, u) = static_cast<float>(sigma);
      if (u % kMarkStridePx != 0 || v % kMarkStridePx != 0) continue;
      marks.push_back(
          {view.index, p.unproject(u, v, triangulated(rig, u, v, in_camera.z())), placed.pose_from_object * point});
    }
  }
}

View view_at(const Placed& placed, const Rig& rig, const TableAngle& angle, int index, std::vector<Mark>& marks,
             Chance& chance) {
  View view{.index = index, .angle_rad = angle.reported_rad, .range = {}, .silhouettes = {}};
  RangeImage& range = view.range;
  range.projection = rig.calibration.left.projection;
  range.camera_from_pose = rig.calibration.left.camera_from_turntable * rot_y(angle.reported_rad);
  const cv::Size size(range.projection.width, range.projection.height);
  range.depth = cv::Mat1f(size, kUnmeasured);
  range.sigma = cv::Mat1f(size, kUnmeasured);
  range.normal = cv::Mat3f(size, cv::Vec3f::all(kUnmeasured));
  range.window_px = static_cast<float>(kWindowPx * kImageScale);
  for (const bool is_left : {true, false}) {
    const Camera& real = is_left ? rig.truth.left : rig.truth.right;
    const Camera& known = is_left ? rig.calibration.left : rig.calibration.right;
    const Sight sight = look(placed, real, real.camera_from_turntable * rot_y(angle.real_rad));
    view.silhouettes.push_back(Silhouette{known.projection, known.camera_from_turntable * rot_y(angle.reported_rad),
                                          outline_distance(sight.face)});
    if (!is_left) continue;
    measure(placed, rig, angle, sight, view, marks, chance);
    add_normals(range, sight.box);
    cv::compare(sight.face, 0, range.background, cv::CMP_LT);
    cv::erode(range.background, range.background, cv::Mat1b::ones(5, 5));
  }
  crop_to_object(view);
  return view;
}

}  // namespace

Rig draw_rig(Chance& chance) {
  Rig rig{.truth = true_rig(), .calibration = {}};
  const auto modes = calibration_modes(rig.truth);
  CameraUnknowns change = CameraUnknowns::Zero();
  for (int mode = 0; mode < modes.cols(); ++mode) change += chance.normal() * modes.col(mode);
  rig.calibration = rig.truth;
  move(rig.calibration.left, change.segment<6>(9));
  move(rig.calibration.right, change.segment<6>(24));
  rig.calibration.quality =
      CalibrationQuality{.grade = "A", .cameras = modes * modes.transpose(), .rim_dots = {}, .board = {}};
  return rig;
}

Scan scan(const Placed& placed, const Rig& rig, const ScanOptions& options, Chance& chance) {
  std::vector<double> errors;
  double mean = 0.0;
  for (int view = 0; view < options.views; ++view) {
    errors.push_back(to_radians(chance.between(-options.max_angle_error_deg, options.max_angle_error_deg)));
    mean += errors.back() / options.views;
  }
  Scan scanned;
  for (int view = 0; view < options.views; ++view) {
    const double reported = 2.0 * std::numbers::pi * view / options.views;
    // An error that all angles of a pose have turns its frame and is none.
    const TableAngle angle{reported + errors[static_cast<std::size_t>(view)] - mean, reported};
    scanned.views.push_back(view_at(placed, rig, angle, view, scanned.marks, chance));
  }
  return scanned;
}

}  // namespace scanrig::campaign
