#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/observations.h"

namespace scanrig {

struct RimDotOptions {
  /// Angle of each dot at table angle 0, counter-clockwise seen from above, radians: the point
  /// rot_y(angle) * (0, 0, radius). Empty: equal steps from 0. A print is a little off; a calibration knows by how
  /// much.
  std::vector<double> angles_rad;
  /// Convex outlines in the image, pixels, of what stands before the table: BoardFinding::outline, for example.
  std::vector<std::vector<Eigen::Vector2d>> hidden_by;
  double search_px = 4.0;           ///< around the predicted place
  double search_along_mm = 0.0;     ///< along the rim before that, while a print's places are not known yet
  double min_contrast = 0.02;       ///< of a dot to its surroundings
  double max_contrast_ratio = 1.6;  ///< to the median of the dots, either way
  double max_residual_ratio = 2.5;  ///< of what a fit leaves, to the median of the dots
};

struct RimDotFinding {
  std::vector<DotObservation> dots;  ///< ascending id
  int outside = 0;                   ///< of the image
  int hidden = 0;                    ///< behind a given outline
  int unclear = 0;                   ///< hidden by something else, or not to be measured
};

/// Measures the dots of the table's rim where `camera` (approximate: to `search_px`) predicts them at
/// `table_angle_rad`. An observation is the image of a dot's centre: the fitted image of the disc has perspective and
/// lens in it, so nothing is left of the ellipse's eccentricity. Pixels, centres at integer coordinates. Raw pixels, as
/// find_board(). Same image, same bits. Threads: any. Fails with `invalid_input`: an image not of its format, no dots
/// configured.
Result<RimDotFinding> find_rim_dots(const cv::Mat& image, const std::string& pixel_format, const Camera& camera,
                                    const RimDots& dots, double table_angle_rad, const RimDotOptions& options = {});

}  // namespace scanrig
