#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>

#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Draws a triangle (camera frame, mm) into the depth map of an orthographic grid, linear between its corners; the
/// nearest surface wins. `depth`: of the grid's size, NaN where nothing is drawn yet.
void draw_triangle(const std::array<Eigen::Vector3d, 3>& corners, const Projection& grid, cv::Mat1f& depth);

}  // namespace scanrig
