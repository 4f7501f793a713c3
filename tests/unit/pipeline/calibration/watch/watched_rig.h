#pragma once

#include <random>
#include <string>

#include "pipeline/calibration/watch/watch.h"

namespace scanrig::test {

/// What has happened to a rig since its calibration.
struct RigChange {
  Eigen::Vector3d left_turn = Eigen::Vector3d::Zero();  ///< about the camera's own centre and axes, rad
  Eigen::Vector3d right_turn = Eigen::Vector3d::Zero();
  Eigen::Vector3d table_shift = Eigen::Vector3d::Zero();  ///< turntable frame, mm
  Eigen::Vector3d table_tilt = Eigen::Vector3d::Zero();   ///< rad
  double angle_step_deg = 0.0;                            ///< the table turns that much more per view
  double table_zero_deg = 0.0;
};

/// The default rig (4267 px, 640 mm, 22 deg above, baseline 160 mm) with 40 rim dots, calibrated at sigma 3 um, as a
/// scan of eight views shows it past an object of 86 mm. Pixels come from the true cameras.
class WatchedRig {
 public:
  explicit WatchedRig(const RigChange& change, unsigned seed = 1);

  /// Noise as measured: dots 0.04 x 0.02 px and 0.004 px per image, rows 0.003 px per view.
  [[nodiscard]] WatchInput observe(int views = 8);
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  /// Rms over the working volume of triangulated minus true points, turntable frame, mean height apart; micrometres.
  [[nodiscard]] double volume_error_um(const Calibration& calibration) const;
  /// Rms of row offsets that a calibration leaves at the object, px.
  [[nodiscard]] double row_error_px(const Calibration& calibration) const;

 private:
  void see_dots(WatchView& view, double angle_rad);
  void see_rows(WatchView& view);
  double gauss(double sigma) { return sigma * unit_(random_); }

  std::mt19937 random_;
  std::normal_distribution<double> unit_{0.0, 1.0};
  Calibration calibration_, truth_;
  RigChange change_;
  std::vector<Eigen::Vector3d> true_dots_;
};

/// One pixel along the rows of the default rig, as an angle.
inline constexpr double kPixel = 1.0 / 4266.7;

}  // namespace scanrig::test
