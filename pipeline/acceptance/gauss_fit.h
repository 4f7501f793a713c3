#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/result.h"
#include "pipeline/acceptance/measured_surface.h"

namespace scanrig::acceptance {

/// What the residuals of a fit say of the errors of its points.
struct PointErrors {
  double rms_mm = 0.0;    ///< of the residuals
  double sigma_mm = 0.0;  ///< as the model states it, rms; NaN: it states none
  /// Points of which one is worth as much as an independent one: 1 plus the correlations of a residual with all around
  /// it. Neighbours share a matching window and voxels.
  double alike = 1.0;
  double alike_mm = 0.0;  ///< radius of the disc that so many points cover

  /// Standard deviation of a point: as stated, or as the residuals are where they are larger [Birge 1932].
  [[nodiscard]] double point_mm() const { return sigma_mm > rms_mm ? sigma_mm : rms_mm; }
};

/// A Gauss fit: least squares of the distances, all points alike [ISO 10360-6]. As parts 2 and 3 of VDI/VDE 2634 allow,
/// at most 3 of 1000 points are left out, those farthest from the fit to all; then it is fitted anew.
struct Fit {
  std::vector<std::uint32_t> points;    ///< of the surface; without those left out
  std::vector<double> residuals_mm;     ///< of these; positive: outside
  std::vector<std::uint32_t> left_out;  ///< points
  std::vector<double> left_out_mm;      ///< their residuals
  PointErrors errors{};

  [[nodiscard]] double range_mm() const;      ///< largest minus smallest residual
  [[nodiscard]] double range_all_mm() const;  ///< the same with the points left out
  [[nodiscard]] double range_95_mm() const;   ///< narrowest interval that holds 95 % of all [ISO 10360-13]
  /// Standard deviation of the range, of so many independent points as there are [Gumbel 1958, 3.1: extremes of normal
  /// errors].
  [[nodiscard]] double range_sigma_mm() const;
};

struct SphereFit : Fit {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_mm = 0.0;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of centre and radius, mm^2
};

/// Without errors and covariance. Fails with `degenerate`: too few points, or a patch so small that its radius is not
/// determined.
Result<SphereFit> fit_sphere(const MeasuredSurface& surface, const std::vector<std::uint32_t>& points);
/// Errors of the points, and the covariance by them: as much work as several fits.
void set_errors(const MeasuredSurface& surface, SphereFit& fit);

struct PlaneFit : Fit {
  double offset_mm = 0.0;  ///< normal . x = offset
};

/// Parallel planes with one normal.
struct PlanesFit {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, outwards
  std::vector<PlaneFit> planes;
  Eigen::MatrixXd covariance;  ///< of the offsets where the normal is common, mm^2
};

/// One set of points each, without errors and covariance. The planes' offsets are those of one common normal. Fails
/// with `degenerate`.
Result<PlanesFit> fit_planes(const MeasuredSurface& surface, const std::vector<std::vector<std::uint32_t>>& points,
                             const Eigen::Vector3d& outwards);
void set_errors(const MeasuredSurface& surface, PlanesFit& fit);

}  // namespace scanrig::acceptance
