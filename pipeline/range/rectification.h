#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "core/result.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Where each pixel of a rectified image lies in the sensor's image, lens distortion included; pixels.
struct RectifyingMap {
  cv::Mat1f u;
  cv::Mat1f v;
};

/// Both cameras turned so that a point lies in the same row of both images. Made once per calibration, used for every
/// view. The principal points are NOT equal: each image keeps the line of sight of its toed-in camera, so that the
/// disparities stay small: u_left - u_right = fx * baseline / z + (left.cx - right.cx).
struct Rectification {
  Projection left, right;  ///< pinhole, same size, focal length and cy
  Transform left_from_turntable = Transform::Identity();
  Transform right_from_turntable = Transform::Identity();
  double baseline_mm = 0.0;
  double table_radius_mm = 0.0;
  int min_disparity = 0;  ///< px, u_left - u_right over the working volume
  int max_disparity = 0;
  RectifyingMap left_map, right_map;
};

/// Working volume above the table, around the axis.
struct WorkingVolume {
  double radius_mm = 65.0;
  double height_mm = 150.0;
};

/// Fails with `invalid_input` (no image size or focal length, no baseline, a baseline along the line of sight) and
/// `out_of_range` (no part of the working volume is seen by both cameras).
Result<Rectification> rectify(const Calibration& calibration, const WorkingVolume& volume = {});

/// Cubic, or, where no detail counts, linear in half the time.
enum class Resampling : std::uint8_t { cubic, linear };

/// A sensor image in the rectified grid, 8 bit, one or three channels; outside the sensor its border is continued.
/// Fails with `invalid_input` for another size or type.
Result<cv::Mat> rectified(const RectifyingMap& map, const cv::Mat& image, Resampling resampling = Resampling::cubic);

/// What of the sensor is seen within `box` of the map's image, and `room_px` around it.
cv::Rect sensor_box(const RectifyingMap& map, const cv::Rect& box, int room_px);

/// The same as grey float values without loss of sub-pixel position (cubic B-spline, prefiltered), for matching.
/// Colour is weighted 1:2:1 (B, G, R), as often as a Bayer sensor samples them. Images of 16 bit are those of
/// merge_exposures(). Grey values (CV_32F) may be given too. `part`: the only pixels that are computed, the others are
/// 0; empty: all.
Result<cv::Mat1f> rectified_grey(const RectifyingMap& map, const cv::Mat& image, const cv::Rect& part = {});

}  // namespace scanrig
