#include "tests/unit/pipeline/calibration/synthetic_board_rig.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace scanrig {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kWidth = 1280, kHeight = 960;
constexpr double kThickness = 3.0;

/// A camera at `centre` that looks at `aim`, image rows down, rolled a little.
Eigen::Isometry3d looking(const Eigen::Vector3d& centre, const Eigen::Vector3d& aim, double roll) {
  Eigen::Matrix3d axes;
  axes.row(2) = (aim - centre).normalized();
  axes.row(0) = Eigen::Vector3d(axes.row(2)).cross(Eigen::Vector3d::UnitY()).normalized();
  axes.row(1) = Eigen::Vector3d(axes.row(2)).cross(Eigen::Vector3d(axes.row(0)));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix() * axes;
  pose.translation() = -(pose.linear() * centre);
  return pose;
}

Eigen::Isometry3d turned(double radians) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitY()));
}

/// A board that faces the cameras at table angle 0: tilted up from lying flat, its lower edge on a block.
Eigen::Isometry3d facing(double tilt_deg, bool is_portrait, double in_front, double block) {
  const double t = tilt_deg * kDegree;
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.linear().col(0) = Eigen::Vector3d::UnitX();
  place.linear().col(1) = Eigen::Vector3d(0.0, -std::sin(t), std::cos(t));
  place.linear().col(2) = Eigen::Vector3d(0.0, -std::cos(t), -std::sin(t));
  if (is_portrait) place.rotate(Eigen::AngleAxisd(90.0 * kDegree, Eigen::Vector3d::UnitZ()));
  const double half = (is_portrait ? 65.0 : 50.0) * std::sin(t);
  place.translation() = Eigen::Vector3d(0.0, std::max(half + block, kThickness), in_front);
  return place;
}

}  // namespace

SyntheticBoardRig::SyntheticBoardRig(const RigFaults& faults, unsigned seed) : faults_(faults), random_(seed) {
  const double focal = 16.0 / 0.00375,
               brown[2][5] = {{-0.080, 0.15, 1.2e-4, -0.9e-4, 0.0}, {-0.084, 0.17, -0.8e-4, 1.1e-4, 0.0}};
  const double middle[2][2] = {{637.2, 481.1}, {641.9, 478.4}};
  for (int c = 0; c < 2; ++c) {
    focal_[c] = focal + 2.4 * c + normal(8.0);
    for (int i = 0; i < 2; ++i) centre_[c][i] = middle[c][i] + normal(3.0);
    for (int i = 0; i < 5; ++i) brown_[c][i] = brown[c][i];
    for (double& phase : phase_[c]) phase = normal(2.0);
    const double up = 22.0 * kDegree, away = 640.0 + 2.0 * c;
    const Eigen::Vector3d place((c == 0 ? -80.0 : 80.0), 45.0 + away * std::sin(up), away * std::cos(up));
    pose_[c] = looking(place, {normal(1.0), 45.0 + normal(1.0), normal(1.0)}, 0.01 * (c == 0 ? 1.0 : -0.7));
  }
  for (int id = 0; id < 88; ++id) {
    const double x = 10.0 * (id % 11 - 5),
                 y = 10.0 * (static_cast<double>(id / 11) - 3.5);  // NOLINT(bugprone-integer-division)
    const double bow =
        faults_.warp_mm * (1.2 * (1.0 - std::cos(0.03 * x)) - 0.8 * std::sin(0.02 * y) * std::sin(0.021 * x));
    print_.emplace_back(faults_.board_scale * x + normal(faults_.print_mm),
                        faults_.board_scale * y + normal(faults_.print_mm), bow + normal(2.5 * faults_.print_mm));
  }
  blank_.width = kWidth;
  blank_.height = kHeight;
  blank_.nominal_focal_px = focal;
  blank_.board.thickness_mm = kThickness;
  blank_.table_radius_mm = 90.0;
  blank_.serials = {"L1", "R1"};
  blank_.length = MeasuredLength{100.0, 100.0, 0.01};
}

Eigen::Vector2d SyntheticBoardRig::through_lens(int camera, const Eigen::Vector3d& p) const {
  const double a = p.x() / p.z(), b = p.y() / p.z(), q = a * a + b * b;
  const double* k = brown_[camera];
  const double ring = 1.0 + k[0] * q + k[1] * std::pow(q, 2) + k[4] * std::pow(q, 3);
  Eigen::Vector2d at(centre_[camera][0] + focal_[camera] * (a * ring + 2.0 * k[2] * a * b + k[3] * (q + 2.0 * a * a)),
                     centre_[camera][1] + focal_[camera] * (b * ring + k[2] * (q + 2.0 * b * b) + 2.0 * k[3] * a * b));
  if (faults_.lens_px > 0.0) {
    const double* f = phase_[camera];
    const double x = at.x() / kWidth, y = at.y() / kHeight, w = 2.0 * std::numbers::pi;
    at += 1.41 * faults_.lens_px *
          Eigen::Vector2d(std::sin(w * 0.9 * x + f[0]) * std::cos(w * 0.7 * y + f[1]) * 1.41,
                          std::sin(w * (0.8 * y + 0.5 * x) + f[2]));
  }
  return at;
}

Eigen::Vector2d SyntheticBoardRig::pixel(int camera, const Eigen::Vector3d& point_in_table) const {
  return through_lens(camera, pose_[camera] * point_in_table);
}

BoardSight SyntheticBoardRig::see(int camera, const Eigen::Isometry3d& table_from_board, const Look& look) {
  Eigen::Isometry3d pose = pose_[camera] * look.wobble * turned(look.angle);
  if (look.has_moved && camera == 1) {
    const double turn = faults_.moved_px / focal_[1];
    pose = Eigen::Isometry3d(Eigen::AngleAxisd(turn, Eigen::Vector3d(0.8, 0.6, 0.0))) * pose;
  }
  if (camera == 1) {
    const double turn = look.progress * faults_.drift_px / focal_[1];
    pose = Eigen::Isometry3d(Eigen::AngleAxisd(turn, Eigen::Vector3d(0.6, 0.8, 0.0))) * pose;
  }
  const double focal_before = focal_[camera];
  if (look.has_moved && camera == 1) focal_[1] *= 1.0 + faults_.focus;
  const Eigen::Isometry3d camera_from_board = pose * table_from_board;
  BoardSight sight;
  const Eigen::Vector3d towards = -camera_from_board.translation().normalized();
  const double facing_cosine = -camera_from_board.linear().col(2).dot(towards);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int id = 0; id < 88 && facing_cosine > 0.2; ++id) {
    Eigen::Vector2d at = through_lens(camera, camera_from_board * print_[static_cast<std::size_t>(id)]);
    at += Eigen::Vector2d(normal(faults_.noise_px), normal(faults_.noise_px));
    if (faults_.outlier_share > 0.0 && share(random_) < faults_.outlier_share) at.x() += 2.0;
    if (at.x() < 8.0 || at.y() < 8.0 || at.x() > kWidth - 9.0 || at.y() > kHeight - 9.0) continue;
    sight.corners.push_back({id, at, 0.8});
  }
  for (int id = 0; id < 40 && faults_.has_dots; ++id) {
    const double around = 2.0 * std::numbers::pi * id / 40.0;
    const Eigen::Vector3d dot(84.5 * std::cos(around), 0.0, -84.5 * std::sin(around));
    Eigen::Vector2d at = through_lens(camera, pose * dot);
    at += Eigen::Vector2d(normal(0.04), normal(0.02));
    const bool is_behind = (turned(look.angle) * dot).z() < 10.0;
    if (is_behind || at.x() < 8.0 || at.y() < 8.0 || at.x() > kWidth - 9.0 || at.y() > kHeight - 9.0) continue;
    sight.dots.push_back({id, at});
  }
  focal_[camera] = focal_before;
  return sight;
}

void SyntheticBoardRig::add_placement(CalibrationInput& input, int number, const Eigen::Isometry3d& facing_cameras,
                                      double mark_deg, bool in_a, bool in_b, const std::vector<double>& angles_deg) {
  const Eigen::Isometry3d table_top(Eigen::AngleAxisd(faults_.axis_tilt_deg * kDegree, Eigen::Vector3d::UnitX()));
  Eigen::Isometry3d place = table_top * turned(-mark_deg * kDegree) * facing_cameras;
  for (std::size_t i = 0; i < angles_deg.size(); ++i) {
    BoardPair pair;
    pair.name = "placement " + std::to_string(number) + " image " + std::to_string(i + 1);
    pair.placement = number;
    pair.in_a = in_a;
    pair.in_b = in_b;
    pair.angle_rad = (mark_deg + angles_deg[i]) * kDegree;
    Look look;
    look.angle = faults_.gear * pair.angle_rad + faults_.gear_deg * kDegree * std::sin(3.0 * pair.angle_rad + 0.4);
    look.wobble.translation() =
        Eigen::Vector3d(normal(faults_.runout_mm), normal(faults_.runout_mm), normal(faults_.runout_mm));
    const double tilt = 0.001 * kDegree * faults_.runout_mm / 0.003;
    look.wobble.rotate(Eigen::AngleAxisd(normal(tilt), Eigen::Vector3d::UnitX()));
    look.wobble.rotate(Eigen::AngleAxisd(normal(tilt), Eigen::Vector3d::UnitZ()));
    look.has_moved = number > 3;
    look.progress = (number - 1 + static_cast<double>(i) / static_cast<double>(angles_deg.size())) / 7.0;
    if (number == faults_.slipped_placement && i == angles_deg.size() / 2)
      place.pretranslate(Eigen::Vector3d(0.08, 0.0, 0.06));
    pair.left = see(0, place, look);
    pair.right = see(1, place, look);
    input.pairs.push_back(pair);
  }
}

CalibrationInput SyntheticBoardRig::observe(int angles_per_placement) {
  CalibrationInput input = blank_;
  std::vector<double> fan, circle;
  for (int i = 0; i < angles_per_placement; ++i) fan.push_back(-56.0 + 112.0 * i / (angles_per_placement - 1));
  for (int i = 0; i <= angles_per_placement; ++i) circle.push_back(360.0 * i / (angles_per_placement + 1));
  add_placement(input, 1, facing(60, false, 35, 0), 0, true, false, fan);
  add_placement(input, 2, facing(60, false, -30, 40), 120, true, false, fan);
  add_placement(input, 3, facing(30, false, 0, 0), 240, true, false, fan);
  add_placement(input, 4, facing(45, true, 30, 0), 60, false, true, fan);
  add_placement(input, 5, facing(40, true, -10, 40), 180, false, true, fan);
  add_placement(input, 6, facing(75, false, -35, 0), 300, false, true, fan);
  add_placement(input, 7, facing(0, false, 0, 0), 10, true, true, circle);
  if (faults_.has_dots) input.rim_dots = {40, 84.5, 2.4};
  return input;
}

CalibrationInput SyntheticBoardRig::observe_hand_held(int pairs) {
  CalibrationInput input = blank_;
  input.form = CalibrationInput::Form::hand_held;
  for (int i = 0; i < pairs; ++i) {
    Eigen::Isometry3d place = facing(70.0, i % 2 == 1, normal(30.0), 10.0 + normal(10.0));
    place.pretranslate(Eigen::Vector3d(normal(10.0), 0.0, 0.0));
    place.rotate(Eigen::AngleAxisd(normal(0.4), Eigen::Vector3d::UnitX()));
    place.rotate(Eigen::AngleAxisd(normal(0.4), Eigen::Vector3d::UnitY()));
    BoardPair pair;
    pair.name = "pair " + std::to_string(i + 1);
    pair.left = see(0, place, {});
    pair.right = see(1, place, {});
    input.pairs.push_back(pair);
  }
  return input;
}

bool SyntheticBoardRig::is_seen(const Eigen::Vector3d& point) const {
  for (int c = 0; c < 2; ++c) {
    const Eigen::Vector2d at = pixel(c, point);
    if (at.x() < 0.0 || at.y() < 0.0 || at.x() > kWidth - 1.0 || at.y() > kHeight - 1.0) return false;
  }
  return true;
}

SyntheticBoardRig::VolumeError SyntheticBoardRig::error_of(const Calibration& calibration) const {
  std::vector<Eigen::Vector3d> points, errors;
  for (double y = 2.0; y < 113.0; y += 22.0) {
    for (double x = -55.0; x <= 55.0; x += 11.0) {
      for (double z = -55.0; z <= 55.0; z += 11.0) {
        if (std::hypot(x, z) > 55.01 || !is_seen({x, y, z})) continue;
        const Eigen::Vector3d p(x, y, z);
        Eigen::Vector3d found = p;
        for (int round = 0; round < 4; ++round) {
          Eigen::Matrix<double, 4, 3> slope;
          Eigen::Vector4d miss;
          for (int c = 0; c < 2; ++c) {
            const Camera& camera = c == 0 ? calibration.left : calibration.right;
            miss.segment<2>(2 * c) = pixel(c, p) - camera.project(found);
            for (int axis = 0; axis < 3; ++axis) {
              const Eigen::Vector3d step = 0.01 * Eigen::Vector3d::Unit(axis);
              slope.block<2, 1>(2 * c, axis) = (camera.project(found + step) - camera.project(found - step)) / 0.02;
            }
          }
          found += slope.colPivHouseholderQr().solve(miss);
        }
        points.push_back(p);
        errors.push_back(found - p);
      }
    }
  }
  Eigen::Matrix2d normal_matrix = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Matrix<double, 3, 2> row;
    row << points[i], Eigen::Vector3d::UnitY();
    normal_matrix += row.transpose() * row;
    right += row.transpose() * errors[i];
  }
  const Eigen::Vector2d fit = normal_matrix.inverse() * right;
  VolumeError result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double size = 1e3 * (errors[i] - fit.x() * points[i] - fit.y() * Eigen::Vector3d::UnitY()).norm();
    result.rms += size * size / static_cast<double>(points.size());
    result.max = std::max(result.max, size);
  }
  result.rms = std::sqrt(result.rms);
  result.scale_ppm = 1e6 * fit.x();
  result.height = 1e3 * fit.y();
  return result;
}

}  // namespace scanrig
