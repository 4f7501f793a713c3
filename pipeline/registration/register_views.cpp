#include "pipeline/registration/register_views.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/registration/range_surface.h"
#include "pipeline/registration/robust.h"

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;  // (rotation vector, translation) about the pose's origin
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr int kAxisUnknowns = 4;  // tilt about x and z, shift along x and z

/// One comparison: the source view's points against the target view's surface.
struct Pairing {
  int source;
  int target;
};

/// A source point and the target's tangent plane next to it, pose frame.
struct Match {
  Eigen::Vector3d point, foot, source_normal, target_normal;
  double sigma;

  [[nodiscard]] double distance() const { return target_normal.dot(point - foot); }
  [[nodiscard]] Vector6 lever() const {
    Vector6 j;
    j << point.cross(target_normal), target_normal;
    return j;
  }
};
using Matches = std::vector<Match>;

/// `reach` 0: all.
std::vector<Pairing> ring_pairings(int views, int reach) {
  std::vector<Pairing> pairings;
  for (int i = 0; i < views; ++i) {
    for (int j = 0; j < views; ++j) {
      const int apart = std::abs(i - j);
      if (i != j && (reach == 0 || std::min(apart, views - apart) <= reach)) pairings.push_back({i, j});
    }
  }
  return pairings;
}

Matches match(const RangeImage& target, const std::vector<SurfacePoint>& source, const Transform& pose_from_source,
              const Transform& target_from_pose, double capture_mm, const RegistrationOptions& options) {
  const Transform target_from_source = target_from_pose * pose_from_source;
  const Transform pose_from_target = target_from_pose.inverse();
  Matches matches;
  for (const SurfacePoint& s : source) {
    if (s.facing < options.min_facing) continue;
    const Eigen::Vector3d point = target_from_source * s.point;
    const Eigen::Vector3d normal = target_from_source.linear() * s.normal;
    const auto plane = tangent_plane_near(target, point);
    if (!plane || plane->facing < options.min_facing || plane->normal.dot(normal) < options.min_agreement) continue;
    if (std::abs(plane->normal.dot(point - plane->point)) > capture_mm) continue;
    matches.push_back({pose_from_source * s.point, pose_from_target * plane->point,
                       pose_from_source.linear() * s.normal, pose_from_target.linear() * plane->normal,
                       std::hypot(s.sigma, plane->sigma)});
  }
  return matches;
}

/// The state of one registration: corrections found so far and the current level.
class Solver {
 public:
  Solver(std::span<const View> views, const RegistrationOptions& options)
      : options_(options),
        views_(views),
        pairings_(ring_pairings(static_cast<int>(views.size()), options.neighbours)),
        correction_(views.size(), Vector6::Zero()) {
    for (const View& view : views) camera_from_pose_.push_back(view.range.camera_from_pose);
  }

  void use_level(const RangeLevel& images, int samples) {
    images_ = &images;
    samples_.resize(images.size());
    parallel_for(images.size(), [&](std::size_t v) { samples_[v] = sample_image(images[v], samples); });
  }

  /// Without a ring: leaves out the pairs that share almost nothing, in `matches`, too.
  void leave_out_apart(std::vector<Matches>& matches) {
    if (options_.neighbours > 0) return;
    std::vector<Pairing> pairings;
    std::vector<Matches> shared;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      const auto points = static_cast<double>(samples_[pairings_[k].source].size());
      if (static_cast<double>(matches[k].size()) < options_.min_shared_share * points) continue;
      pairings.push_back(pairings_[k]);
      shared.push_back(std::move(matches[k]));
    }
    pairings_ = std::move(pairings);
    matches = std::move(shared);
  }

  [[nodiscard]] std::vector<Matches> match_all(double capture_mm) const {
    std::vector<Matches> matches(pairings_.size());
    parallel_for(pairings_.size(), [&](std::size_t k) {
      const auto [i, j] = pairings_[k];
      matches[k] =
          match((*images_)[j], samples_[i], camera_from_pose_[i].inverse(), camera_from_pose_[j], capture_mm, options_);
    });
    return matches;
  }

  /// Performs one Gauss-Newton step; returns the largest movement of the surface, mm.
  double step(const std::vector<Matches>& matches);

  /// Leverage of the table angle: the slope along the turn, from both views' normals. Their noise is independent, so
  /// noise alone gives 0.
  [[nodiscard]] static double leverage(const std::vector<Matches>& matches);
  void hold_angles() { angles_held_ = true; }

  void describe(const std::vector<Matches>& matches, bool after, RegistrationReport& report) const;
  void describe_corrections(RegistrationReport& report) const;
  [[nodiscard]] const Transform& camera_from_pose(std::size_t v) const { return camera_from_pose_[v]; }

 private:
  [[nodiscard]] Matrix6 prior_information() const;
  [[nodiscard]] Eigen::Matrix<double, 6, kAxisUnknowns> axis_effect(std::size_t v) const;
  void add_data(const std::vector<Matches>& matches, Eigen::MatrixXd& normal, Eigen::VectorXd& right) const;
  void hold_common_motion(Eigen::MatrixXd& normal, Eigen::VectorXd& right) const;
  void add_priors(Eigen::MatrixXd& normal, Eigen::VectorXd& right) const;

  RegistrationOptions options_;
  std::span<const View> views_;
  std::vector<Pairing> pairings_;
  std::vector<Vector6> correction_;
  Eigen::Vector4d axis_ = Eigen::Vector4d::Zero();
  std::vector<Transform> camera_from_pose_;
  const RangeLevel* images_ = nullptr;
  std::vector<std::vector<SurfacePoint>> samples_;
  bool angles_held_ = false;
};

double variance(double sigma) { return std::max(sigma * sigma, 1e-14); }

Matrix6 Solver::prior_information() const {
  Vector6 spread;
  spread.head<3>().setConstant(variance(to_radians(options_.rotation_sigma_deg)));
  spread.tail<3>().setConstant(variance(options_.translation_sigma_mm));
  spread[1] = angles_held_ ? variance(0.0) : spread[1] + variance(to_radians(options_.angle_sigma_deg));
  return spread.cwiseInverse().asDiagonal();
}

/// Effect of an error of the axis on the view at table angle theta: the axis moves with the camera, so seen from the
/// object it turns with the table.
Eigen::Matrix<double, 6, kAxisUnknowns> Solver::axis_effect(std::size_t v) const {
  const Eigen::Matrix3d turned = rot_y(-views_[v].angle_rad).linear();
  Eigen::Matrix<double, 6, kAxisUnknowns> effect = Eigen::Matrix<double, 6, kAxisUnknowns>::Zero();
  effect.block<3, 1>(0, 0) = turned.col(0);
  effect.block<3, 1>(0, 1) = turned.col(2);
  effect.block<3, 1>(3, 2) = turned.col(0);
  effect.block<3, 1>(3, 3) = turned.col(2);
  return effect;
}

void Solver::add_data(const std::vector<Matches>& matches, Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
  struct Sums {
    Matrix6 h = Matrix6::Zero();
    Vector6 g = Vector6::Zero();
    double weight = 0.0;
  };
  std::vector<double> all;
  for (const Matches& pair : matches) {
    for (const Match& m : pair) all.push_back(std::abs(m.distance()) / m.sigma);
  }
  const double scale = options_.robust_scale * std::max(1.0, 1.4826 * quantile(std::move(all), 0.5));
  std::vector<Sums> sums(matches.size());
  parallel_for(matches.size(), [&](std::size_t k) {
    for (const Match& m : matches[k]) {
      const double w = robust_weight(m.distance() / m.sigma, scale) / (m.sigma * m.sigma);
      const Vector6 j = m.lever();
      sums[k].h.noalias() += w * j * j.transpose();
      sums[k].g += w * m.distance() * j;
      sums[k].weight += w;
    }
    // A common error of two views does not average away with the number of points.
    const double share = 1.0 / (1.0 + sums[k].weight * options_.pair_bias_mm * options_.pair_bias_mm);
    sums[k].h *= share;
    sums[k].g *= share;
  });
  // camera_from_pose * exp(x) moves the view's surface by -x: the source's lever is -j, the target's +j.
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const int a = kAxisUnknowns + 6 * pairings_[k].source;
    const int b = kAxisUnknowns + 6 * pairings_[k].target;
    normal.block<6, 6>(a, a) += sums[k].h;
    normal.block<6, 6>(b, b) += sums[k].h;
    normal.block<6, 6>(a, b) -= sums[k].h;
    normal.block<6, 6>(b, a) -= sums[k].h;
    right.segment<6>(a) += sums[k].g;
    right.segment<6>(b) -= sums[k].g;
  }
}

void Solver::add_priors(Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
  const Matrix6 information = prior_information();
  for (std::size_t v = 0; v < correction_.size(); ++v) {
    const int a = kAxisUnknowns + 6 * static_cast<int>(v);
    const auto effect = axis_effect(v);
    normal.block<6, 6>(a, a) += information;
    normal.block<6, kAxisUnknowns>(a, 0) -= information * effect;
    normal.block<kAxisUnknowns, 6>(0, a) -= effect.transpose() * information;
    normal.block<kAxisUnknowns, kAxisUnknowns>(0, 0) += effect.transpose() * information * effect;
    right.segment<6>(a) -= information * correction_[v];
    right.head<kAxisUnknowns>() += effect.transpose() * information * correction_[v];
  }
  hold_common_motion(normal, right);
  const double tilt = 1.0 / variance(to_radians(options_.axis_tilt_sigma_deg));
  const double shift = 1.0 / variance(options_.axis_shift_sigma_mm);
  normal.diagonal().head<kAxisUnknowns>() += Eigen::Vector4d(tilt, tilt, shift, shift);
}

/// The common part of all views' corrections, seen from their cameras, belongs to the axis and only to the axis. Left
/// to the views it would absorb scanner errors at grazing incidence: b (1 - cos) is the effect of moving every view b
/// towards its camera, and the model grows by b.
void Solver::hold_common_motion(Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
  constexpr double kInformation = 1e10;  // 1 / (0.01 um)^2 or 1 / (0.0006 deg)^2
  const auto views = static_cast<double>(correction_.size());
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(kAxisUnknowns, normal.cols());  // of the corrections, less the axis
  mean.leftCols<kAxisUnknowns>() = -Eigen::Matrix4d::Identity();
  Eigen::Vector4d now = Eigen::Vector4d::Zero();  // the axis is solved for anew, the corrections are added to
  for (std::size_t v = 0; v < correction_.size(); ++v) {
    const Eigen::Matrix<double, kAxisUnknowns, 6> share = axis_effect(v).transpose() / views;
    mean.middleCols<6>(kAxisUnknowns + 6 * static_cast<int>(v)) = share;
    now += share * correction_[v];
  }
  normal += kInformation * mean.transpose() * mean;
  right -= kInformation * mean.transpose() * now;
}

double Solver::step(const std::vector<Matches>& matches) {
  const int unknowns = kAxisUnknowns + 6 * static_cast<int>(correction_.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  add_data(matches, normal, right);
  add_priors(normal, right);
  const Eigen::VectorXd solution = normal.ldlt().solve(right);
  axis_ = solution.head<kAxisUnknowns>();
  double largest = 0.0;
  for (std::size_t v = 0; v < correction_.size(); ++v) {
    const Vector6 delta = solution.segment<6>(kAxisUnknowns + 6 * static_cast<int>(v));
    correction_[v] += delta;
    camera_from_pose_[v] = camera_from_pose_[v] * small_motion(delta.head<3>(), delta.tail<3>());
    largest = std::max(largest, delta.head<3>().norm() * options_.arm_mm + delta.tail<3>().norm());
  }
  return largest;
}

double Solver::leverage(const std::vector<Matches>& matches) {
  double slope = 0.0;
  double radius = 0.0;
  for (const Matches& pair : matches) {
    for (const Match& m : pair) {
      const Eigen::Vector3d turn = Eigen::Vector3d::UnitY().cross(m.point);
      slope += m.source_normal.dot(turn) * m.target_normal.dot(turn);
      radius += turn.squaredNorm();
    }
  }
  return radius > 0.0 ? std::sqrt(std::max(0.0, slope / radius)) : 0.0;
}

void Solver::describe(const std::vector<Matches>& matches, bool after, RegistrationReport& report) const {
  report.views.resize(views_.size());
  std::vector<double> all;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    std::vector<double> distances;
    std::size_t matched = 0;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      if (pairings_[k].source != static_cast<int>(v)) continue;
      for (const Match& m : matches[k]) distances.push_back(std::abs(m.distance()));
      matched = std::max(matched, matches[k].size());
    }
    ViewFit& fit = report.views[v];
    fit.index = views_[v].index;
    fit.overlap = static_cast<double>(matched) / static_cast<double>(std::max<std::size_t>(samples_[v].size(), 1));
    (after ? fit.rms_after_mm : fit.rms_before_mm) = root_mean_square(distances);
    (after ? fit.median_after_mm : fit.median_before_mm) = quantile(distances, 0.5);
    all.insert(all.end(), distances.begin(), distances.end());
  }
  (after ? report.median_after_mm : report.median_before_mm) = quantile(std::move(all), 0.5);
}

void Solver::describe_corrections(RegistrationReport& report) const {
  const double angle = variance(to_radians(options_.angle_sigma_deg));
  const double share = angles_held_ ? 0.0 : angle / (angle + variance(to_radians(options_.rotation_sigma_deg)));
  for (std::size_t v = 0; v < correction_.size(); ++v) {
    const Vector6 own = correction_[v] - axis_effect(v) * axis_;
    ViewFit& fit = report.views[v];
    fit.angle_correction_deg = to_degrees(share * own[1]);
    fit.rotation_deg = own.head<3>() * to_degrees(1.0);
    fit.rotation_deg.y() *= 1.0 - share;
    fit.translation_mm = own.tail<3>();
  }
  report.axis_tilt_deg = to_degrees(axis_.head<2>().norm());
  report.axis_shift_mm = axis_.tail<2>().norm();
}

std::size_t largest(const std::vector<Matches>& matches) {
  std::size_t largest = 0;
  for (const Matches& pair : matches) largest = std::max(largest, pair.size());
  return largest;
}

Result<void> check(std::span<const View> views, std::size_t min_points) {
  int best = 0;
  for (const View& view : views) {
    const RangeImage& r = view.range;
    const cv::Size size(r.projection.width, r.projection.height);
    if (r.depth.size() != size || r.sigma.size() != size || r.normal.size() != size) {
      return fail(ErrorCode::invalid_input, "registration: view {}: depth, sigma and normals differ in size",
                  view.index);
    }
    best = std::max(best, cv::countNonZero(r.depth == r.depth));
  }
  if (best < static_cast<int>(min_points)) {
    return fail(ErrorCode::degenerate, "registration: no view has {} measured points; check exposure and focus",
                min_points);
  }
  return {};
}

}  // namespace

RegistrationOptions RegistrationOptions::imported() {
  RegistrationOptions options;
  options.angle_sigma_deg = 0.5;
  options.rotation_sigma_deg = 0.5;
  options.translation_sigma_mm = 1.0;
  options.axis_tilt_sigma_deg = options.axis_shift_sigma_mm = 0.0;
  options.pair_bias_mm = 0.02;
  options.capture_mm = 4.0;
  options.min_facing = 0.25;
  return options;
}

RegistrationOptions RegistrationOptions::placed() {
  RegistrationOptions options = imported();
  options.neighbours = 0;
  return options;
}

Result<RegistrationReport> register_views(std::span<View> views, const RegistrationOptions& options,
                                          const Context& context) {
  if (auto ok = check(views, options.min_shared); !ok) return pass_on(ok);
  RegistrationReport report;
  Solver solver(views, options);
  const auto pyramid = range_pyramid(views, options.levels);
  solver.use_level(pyramid[0], options.samples);
  auto before = solver.match_all(options.capture_mm);
  if (views.size() > 1 && largest(before) < options.min_shared) {
    return fail(ErrorCode::no_overlap,
                "registration: no two neighbouring views share {} points within {} mm; check the "
                "table angles and the calibration",
                options.min_shared, options.capture_mm);
  }
  solver.leave_out_apart(before);
  solver.describe(before, false, report);
  report.angle_leverage = Solver::leverage(before);
  report.angle_observable = report.angle_leverage >= options.min_leverage;
  if (!report.angle_observable) solver.hold_angles();
  for (int level = options.levels - 1; level >= 0; --level) {
    solver.use_level(pyramid[level], options.samples >> (2 * level));
    const double capture = options.capture_mm / (1 << (options.levels - 1 - level));
    for (int k = 0; k < options.max_iterations; ++k) {
      if (context.stopped()) return fail(ErrorCode::stopped, "registration: stopped");
      if (solver.step(solver.match_all(capture)) < options.settled_mm) break;
    }
    context.report("registration", 1.0 - static_cast<double>(level) / options.levels);
  }
  solver.describe(solver.match_all(options.capture_mm), true, report);
  solver.describe_corrections(report);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Transform move = views[v].range.camera_from_pose.inverse() * solver.camera_from_pose(v);
    views[v].range.camera_from_pose = solver.camera_from_pose(v);
    for (Silhouette& s : views[v].silhouettes) s.camera_from_pose = s.camera_from_pose * move;
  }
  return report;
}

}  // namespace scanrig
