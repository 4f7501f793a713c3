#pragma once

#include <opencv2/core/mat.hpp>

#include "core/transform.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// The outline of the object in one distortion-free image.
struct Silhouette {
  Projection projection;                              ///< pinhole
  Transform camera_from_pose = Transform::Identity();  ///< the pose's turntable frame at table angle 0 -> this camera
  cv::Mat1f outside_px;  ///< signed distance to the contour in pixels, sub-pixel, positive outside the object
};

}  // namespace scanrig
