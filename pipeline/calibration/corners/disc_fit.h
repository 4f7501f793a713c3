#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>

#include "pipeline/calibration/corners/corner_image.h"

namespace scanrig {

/// How an image shows a small printed disc: pixels to the disc's plane, to second order, so that perspective and lens
/// are in it.
class DiscShape {
 public:
  /// `pixel_of`: pixel of a point of the disc's plane, given in radii from its centre. No value: degenerate.
  static std::optional<DiscShape> predict(const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& pixel_of);

  [[nodiscard]] const Eigen::Vector2d& centre() const { return centre_; }  ///< pixel of the disc's centre
  /// Point of the disc's plane, in radii, at `from_centre` pixels from centre().
  [[nodiscard]] Eigen::Vector2d on_disc(const Eigen::Vector2d& from_centre) const;
  /// d on_disc / d pixel.
  [[nodiscard]] Eigen::Matrix2d jacobian(const Eigen::Vector2d& from_centre) const;

 private:
  Eigen::Vector2d centre_{0.0, 0.0};
  Eigen::Matrix<double, 6, 2> terms_ = Eigen::Matrix<double, 6, 2>::Zero();
};

struct Disc {
  Eigen::Vector2d shift{0.0, 0.0};  ///< from where `shape` predicts the centre, pixels
  double blur_px = 1.0;             ///< sigma of the edge
  double size = 1.0;                ///< diameter as a share of the predicted one
  double contrast = 0.0;            ///< inside minus outside as a share of both, mean over the patch; above 0: brighter
  double noise = 0.0;               ///< rms of what the fit leaves, as a share of the light
};

/// Sum of squares that a disc of the predicted size, at the predicted place, explains in `pixels`. Same for any offset
/// of the light.
double explained_by_disc(std::span<const FitPixel> pixels, int colours, const DiscShape& shape);

/// Fits the image of a disc: shift, blur, size, gain and offset per colour. `pixels` are relative to `shape.centre()`,
/// whole pixels from each other. The shift is found within `search_px`. No value: not converged. Threads: any.
std::optional<Disc> fit_disc(std::span<const FitPixel> pixels, int colours, const DiscShape& shape, double search_px);

}  // namespace scanrig
