#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The mesh as a camera without distortion sees it.
struct DepthMap {
  cv::Rect window;  ///< pixels that can show the mesh; they may lie beyond the image by what a lens pulls into it
  cv::Mat1f depth;  ///< of the window: z in the camera frame, mm, at the pixel's centre; NaN where no mesh is
};

/// `projection` pinhole. Faces that reach behind the camera are left out. One thread; any number may draw.
DepthMap draw_depth(const Mesh& mesh, const Projection& projection, const Transform& camera_from_model);

}  // namespace scanrig
