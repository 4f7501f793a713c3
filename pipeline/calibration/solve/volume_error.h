#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/solve/normal_matrix.h"
#include "pipeline/calibration/solve/solved_calibration.h"

namespace scanrig {

/// Points that fill the volume, those that both cameras see; turntable frame, mm.
std::vector<Eigen::Vector3d> volume_grid(const Calibration& calibration, const CalibrationVolume& volume = {});

/// The point whose two pixels are nearest to the given ones, by least squares in pixels. `start`: within a millimetre.
Eigen::Vector3d triangulate(const Calibration& calibration, const Eigen::Vector2d& left, const Eigen::Vector2d& right,
                            const Eigen::Vector3d& start);

/// How a change of each unknown moves the triangulated points: rows are the unknowns, three columns per point.
Eigen::MatrixXd volume_response(const CalibrationInput& input, const Unknowns& unknowns, const Linearised& linear,
                                const std::vector<Eigen::Vector3d>& grid);

/// Splits a field of shifts over the grid into its parts; each is a projection, and they add up to the field.
class VolumeParts {
 public:
  explicit VolumeParts(const std::vector<Eigen::Vector3d>& grid);
  /// Rms and greatest sigma of the parts of fields whose covariance is half' half (three columns per point).
  [[nodiscard]] VolumeSigma sigma(const Eigen::MatrixXd& half) const;
  /// The same at each point, in the grid's order.
  [[nodiscard]] std::vector<PointSigma> sigma_at(const Eigen::MatrixXd& half) const;
  /// A field without its scale and base; three values per point.
  [[nodiscard]] Eigen::VectorXd without_scale_and_base(const Eigen::VectorXd& field) const;
  [[nodiscard]] Eigen::VectorXd coefficients(const Eigen::VectorXd& field) const;

 private:
  /// A field's parts, each as long as the field.
  struct Split {
    Eigen::MatrixXd axis, azimuth, scale, base, strain, volume;
  };
  [[nodiscard]] Split split(const Eigen::MatrixXd& half) const;

  std::vector<Eigen::Vector3d> grid_;
  Eigen::MatrixXd modes_;   ///< columns: shift x, z, tilt x, z; turn about y; scale; shift y
  Eigen::MatrixXd fitted_;  ///< their least-squares coefficients from a field
};

/// Rms over points of a field with three values per point.
double rms_per_point(const Eigen::VectorXd& field);
double max_per_point(const Eigen::VectorXd& field);

/// What `other` makes of the points that `reference` sees at the grid, minus the grid.
Eigen::VectorXd volume_difference(const Calibration& reference, const Calibration& other,
                                  const std::vector<Eigen::Vector3d>& grid);

}  // namespace scanrig
