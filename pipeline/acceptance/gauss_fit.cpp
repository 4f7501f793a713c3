#include "pipeline/acceptance/gauss_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/statistics.h"
#include "pipeline/acceptance/point_tree.h"

namespace scanrig::acceptance {
namespace {

using Eigen::Vector3d;

constexpr double kMayLeaveOut = 0.003;  // VDI/VDE 2634: 3 of 1000
constexpr double kMajority = 0.95;      // ISO 10360-13
constexpr int kMaxSteps = 50;
constexpr std::size_t kPairBases = 500;  // points whose correlations with those around are taken
constexpr std::size_t kFirstBins = 16;   // edges of the model within which their end is looked for first
constexpr std::size_t kMinPoints = 30;

/// Sums by distance over pairs of points, of the residuals' products.
struct PairSums {
  std::vector<double> products, pairs;
  std::size_t bases = 0;

  /// The bin at which points are no more alike; nothing: they are alike as far as this reaches.
  [[nodiscard]] std::optional<std::size_t> end() const {
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (pairs[k] > 0.0 && products[k] <= 0.0) return k;
    }
    return std::nullopt;
  }
};

/// Of some of the points with all within `bins` bins.
PairSums pair_sums(const Fit& fit, const std::vector<Vector3d>& points, const PointTree& tree, double bin_mm,
                   std::size_t bins) {
  PairSums sums{.products = std::vector<double>(bins, 0.0), .pairs = std::vector<double>(bins, 0.0)};
  const std::size_t step = std::max<std::size_t>(1, points.size() / kPairBases);
  const double reach = bin_mm * static_cast<double>(bins);
  for (std::size_t i = step / 2; i < points.size(); i += step, ++sums.bases) {
    WithinReach around(reach, [&](std::size_t j, double squared) {
      const auto k = static_cast<std::size_t>(std::sqrt(squared) / bin_mm);
      if (j == i || k >= bins) return;
      sums.products[k] += fit.residuals_mm[i] * fit.residuals_mm[j];
      sums.pairs[k] += 1.0;
    });
    tree.findNeighbors(around, points[i].data(), {});
  }
  return sums;
}

/// Mean correlation of residuals by distance, up to where it ends, as a number of points.
double alike_points(const MeasuredSurface& surface, const Fit& fit) {
  const auto count = static_cast<double>(fit.points.size());
  std::vector<Vector3d> points;
  double variance = 0.0;
  Vector3d low = Vector3d::Constant(1e300), high = -low;
  for (std::size_t i = 0; i < fit.points.size(); ++i) {
    variance += fit.residuals_mm[i] * fit.residuals_mm[i] / count;
    points.push_back(surface.points[fit.points[i]]);
    low = low.cwiseMin(points.back());
    high = high.cwiseMax(points.back());
  }
  if (!(variance > 0.0)) return 1.0;
  const double bin = surface.spacing_mm;
  const auto most = static_cast<std::size_t>(std::ceil(0.5 * (high - low).norm() / bin));
  const Cloud cloud{points};
  const PointTree tree(3, cloud);
  // They mostly end soon, and all pairs of a million points are many.
  std::size_t bins = std::min(most, kFirstBins);
  PairSums sums = pair_sums(fit, points, tree, bin, bins);
  while (!sums.end() && bins < most) {
    bins = std::min(most, 2 * bins);
    sums = pair_sums(fit, points, tree, bin, bins);
  }
  const std::size_t end = sums.end().value_or(bins);
  double alike = 1.0;
  for (std::size_t k = 0; k < end; ++k) alike += sums.products[k] / (variance * static_cast<double>(sums.bases));
  return std::min(alike, count / 2.0);
}

PointErrors errors_of(const MeasuredSurface& surface, const Fit& fit) {
  PointErrors errors;
  errors.rms_mm = root_mean_square(fit.residuals_mm);
  std::vector<double> stated;
  for (const std::uint32_t i : fit.points) {
    if (std::isfinite(surface.sigma_mm[i])) stated.push_back(surface.sigma_mm[i]);
  }
  errors.sigma_mm = root_mean_square(stated);
  errors.alike = alike_points(surface, fit);
  double area = 0.0;
  for (const std::uint32_t i : fit.points) area += surface.area_mm2[i];
  errors.alike_mm = std::sqrt(errors.alike * area / static_cast<double>(fit.points.size()) / std::numbers::pi);
  return errors;
}

/// Takes the farthest points out of the fit, as many as may be.
void leave_out_farthest(Fit& fit) {
  const auto may = static_cast<std::size_t>(kMayLeaveOut * static_cast<double>(fit.points.size()));
  std::vector<std::size_t> order(fit.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    const double away_a = std::abs(fit.residuals_mm[a]), away_b = std::abs(fit.residuals_mm[b]);
    return away_a != away_b ? away_a > away_b : a < b;
  });
  std::vector<bool> is_out(fit.points.size(), false);
  for (std::size_t k = 0; k < may; ++k) is_out[order[k]] = true;
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < is_out.size(); ++i) (is_out[i] ? fit.left_out : kept).push_back(fit.points[i]);
  fit.points = std::move(kept);
}

struct Ball {
  Vector3d centre = Vector3d::Zero();
  double radius = 0.0;
};

/// Linear start: |p|^2 = 2 p.c + (r^2 - |c|^2), about the points' mean.
Ball linear_ball(const MeasuredSurface& surface, const std::vector<std::uint32_t>& points) {
  Vector3d mean = Vector3d::Zero();
  for (const std::uint32_t i : points) mean += surface.points[i] / static_cast<double>(points.size());
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const std::uint32_t i : points) {
    const Vector3d p = surface.points[i] - mean;
    const Eigen::Vector4d row(2.0 * p.x(), 2.0 * p.y(), 2.0 * p.z(), 1.0);
    normal += row * row.transpose();
    sum += row * p.squaredNorm();
  }
  const Eigen::Vector4d solution = normal.ldlt().solve(sum);
  return {mean + solution.head<3>(), std::sqrt(std::max(0.0, solution[3] + solution.head<3>().squaredNorm()))};
}

/// How a point's distance changes with the ball: against its centre and its radius.
Eigen::Vector4d ball_row(const Vector3d& away, double distance) {
  Eigen::Vector4d row;
  row << away / distance, 1.0;
  return row;
}

/// Gauss-Newton on the distances.
Ball best_ball(const MeasuredSurface& surface, const std::vector<std::uint32_t>& points) {
  Ball ball = linear_ball(surface, points);
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (const std::uint32_t i : points) {
      const Vector3d away = surface.points[i] - ball.centre;
      const double distance = away.norm();
      const Eigen::Vector4d row = ball_row(away, distance);
      normal += row * row.transpose();
      sum += row * (distance - ball.radius);
    }
    const Eigen::Vector4d change = normal.ldlt().solve(sum);
    ball.centre += change.head<3>();
    ball.radius += change[3];
    if (!(change.norm() > 1e-9)) break;
  }
  return ball;
}

void set_residuals(const MeasuredSurface& surface, const Ball& ball, SphereFit& fit) {
  const auto residual = [&](std::uint32_t i) { return (surface.points[i] - ball.centre).norm() - ball.radius; };
  fit.residuals_mm.clear();
  for (const std::uint32_t i : fit.points) fit.residuals_mm.push_back(residual(i));
  fit.left_out_mm.clear();
  for (const std::uint32_t i : fit.left_out) fit.left_out_mm.push_back(residual(i));
}

Vector3d mean_of(const MeasuredSurface& surface, const std::vector<std::uint32_t>& points) {
  Vector3d mean = Vector3d::Zero();
  for (const std::uint32_t i : points) mean += surface.points[i];
  return mean / static_cast<double>(points.size());
}

/// The normal in which the points of each set vary least about the set's mean.
Vector3d common_normal(const MeasuredSurface& surface, const std::vector<PlaneFit>& planes, const Vector3d& outwards) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const PlaneFit& plane : planes) {
    const Vector3d mean = mean_of(surface, plane.points);
    for (const std::uint32_t i : plane.points) {
      const Vector3d p = surface.points[i] - mean;
      scatter += p * p.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  const Vector3d normal = solver.eigenvectors().col(0);
  return normal.dot(outwards) < 0.0 ? Vector3d(-normal) : normal;
}

void set_residuals(const MeasuredSurface& surface, PlanesFit& fit) {
  for (PlaneFit& plane : fit.planes) {
    plane.offset_mm = fit.normal.dot(mean_of(surface, plane.points));
    const auto residual = [&](std::uint32_t i) { return fit.normal.dot(surface.points[i]) - plane.offset_mm; };
    plane.residuals_mm.clear();
    for (const std::uint32_t i : plane.points) plane.residuals_mm.push_back(residual(i));
    plane.left_out_mm.clear();
    for (const std::uint32_t i : plane.left_out) plane.left_out_mm.push_back(residual(i));
  }
}

/// Of the offsets at the planes' common middle: each plane's own, and what the normal's two angles add.
Eigen::MatrixXd offsets_covariance(const MeasuredSurface& surface, const PlanesFit& fit) {
  const auto count = static_cast<Eigen::Index>(fit.planes.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  const Vector3d x = fit.normal.unitOrthogonal(), y = fit.normal.cross(x);
  Eigen::Matrix2d tilt_weight = Eigen::Matrix2d::Zero();
  Eigen::MatrixXd arms(count, 2);
  for (Eigen::Index k = 0; k < count; ++k) {
    const PlaneFit& plane = fit.planes[static_cast<std::size_t>(k)];
    const Vector3d mean = mean_of(surface, plane.points);
    const double variance = plane.errors.point_mm() * plane.errors.point_mm() * plane.errors.alike;
    arms.row(k) << mean.dot(x), mean.dot(y);
    for (const std::uint32_t i : plane.points) {
      const Vector3d p = surface.points[i] - mean;
      const Eigen::Vector2d row(p.dot(x), p.dot(y));
      tilt_weight += row * row.transpose() / variance;
    }
    covariance(k, k) += variance / static_cast<double>(plane.points.size());
  }
  covariance += arms * tilt_weight.inverse() * arms.transpose();
  return covariance;
}

}  // namespace

double Fit::range_mm() const {
  const auto [low, high] = std::ranges::minmax_element(residuals_mm);
  return *high - *low;
}

double Fit::range_all_mm() const {
  auto [low, high] = std::ranges::minmax(residuals_mm);
  for (const double residual : left_out_mm) {
    low = std::min(low, residual);
    high = std::max(high, residual);
  }
  return high - low;
}

double Fit::range_95_mm() const {
  std::vector<double> all = residuals_mm;
  all.insert(all.end(), left_out_mm.begin(), left_out_mm.end());
  std::ranges::sort(all);
  const auto held = static_cast<std::size_t>(std::ceil(kMajority * static_cast<double>(all.size())));
  double narrowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + held <= all.size(); ++i) narrowest = std::min(narrowest, all[i + held - 1] - all[i]);
  return narrowest;
}

double Fit::range_sigma_mm() const {
  const double independent = std::max(2.0, static_cast<double>(points.size()) / errors.alike);
  const double of_an_extreme = std::numbers::pi / std::sqrt(6.0) / std::sqrt(2.0 * std::log(independent));
  return std::numbers::sqrt2 * of_an_extreme * errors.rms_mm;
}

Result<SphereFit> fit_sphere(const MeasuredSurface& surface, const std::vector<std::uint32_t>& points) {
  if (points.size() < kMinPoints) {
    return fail(ErrorCode::degenerate, "{} measured points; a sphere needs {}", points.size(), kMinPoints);
  }
  SphereFit fit;
  fit.points = points;
  Ball ball = best_ball(surface, fit.points);
  set_residuals(surface, ball, fit);
  leave_out_farthest(fit);
  ball = best_ball(surface, fit.points);
  if (!ball.centre.allFinite() || !(ball.radius > 0.0)) {
    return fail(ErrorCode::degenerate, "the measured points do not determine a sphere");
  }
  set_residuals(surface, ball, fit);
  fit.centre = ball.centre;
  fit.radius_mm = ball.radius;
  return fit;
}

void set_errors(const MeasuredSurface& surface, SphereFit& fit) {
  fit.errors = errors_of(surface, fit);
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const std::uint32_t i : fit.points) {
    const Vector3d away = surface.points[i] - fit.centre;
    const Eigen::Vector4d row = ball_row(away, away.norm());
    normal += row * row.transpose();
  }
  const double variance = fit.errors.point_mm() * fit.errors.point_mm() * fit.errors.alike;
  fit.covariance = variance * normal.inverse();
}

Result<PlanesFit> fit_planes(const MeasuredSurface& surface, const std::vector<std::vector<std::uint32_t>>& points,
                             const Vector3d& outwards) {
  PlanesFit fit;
  for (const auto& set : points) {
    if (set.size() < kMinPoints) {
      return fail(ErrorCode::degenerate, "{} measured points; a plane needs {}", set.size(), kMinPoints);
    }
    fit.planes.emplace_back().points = set;
  }
  fit.normal = common_normal(surface, fit.planes, outwards);
  set_residuals(surface, fit);
  for (PlaneFit& plane : fit.planes) leave_out_farthest(plane);
  fit.normal = common_normal(surface, fit.planes, outwards);
  set_residuals(surface, fit);
  return fit;
}

void set_errors(const MeasuredSurface& surface, PlanesFit& fit) {
  for (PlaneFit& plane : fit.planes) plane.errors = errors_of(surface, plane);
  fit.covariance = offsets_covariance(surface, fit);
}

}  // namespace scanrig::acceptance
