#pragma once

#include <limits>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/range/row_offsets.h"
#include "pipeline/silhouette/silhouette.h"

namespace scanrig {

inline constexpr float kUnmeasured = std::numeric_limits<float>::quiet_NaN();

/// The surface measured from one view, on a regular grid. All matrices have the projection's size.
struct RangeImage {
  Projection projection;
  Transform camera_from_pose = Transform::Identity();  ///< the pose's turntable frame at table angle 0 -> this camera
  cv::Mat1f depth;                                     ///< z in the camera frame, mm; NaN where unmeasured
  cv::Mat1f sigma;                                     ///< standard deviation of depth, mm; NaN where depth is
  cv::Mat3f normal;  ///< unit, camera frame, towards the camera (z < 0); NaN where depth is
  /// 255 where a NaN pixel shows background (free space all along its ray); empty: background unknown.
  cv::Mat1b background;
  float window_px = 0.0F;           ///< half width of the window that a pixel was measured with; 0: the pixel alone
  RowOffsets row_offsets = {};      ///< of the stereo pair; empty for imported range scans
  bool background_is_whole = true;  ///< else pixels that are neither measured nor background may be either
};

/// Frees depth, sigma, normal and background; what is left says where the view stands.
inline void release_matrices(RangeImage& range) {
  range.depth = range.sigma = cv::Mat1f();
  range.normal = cv::Mat3f();
  range.background = cv::Mat1b();
}

/// One table angle of one pose, for registration and volume.
struct View {
  int index = 0;
  double angle_rad = 0.0;  ///< table angle as measured
  RangeImage range;
  std::vector<Silhouette> silhouettes;  ///< of the left and the right camera; without a key, free_space()
};

}  // namespace scanrig
