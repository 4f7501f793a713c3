#pragma once

#include <opencv2/core/mat.hpp>

#include "pipeline/range/range_image.h"

namespace scanrig {

/// A range image from an imported depth grid: normals from the neighbours on the same surface, sigma from the typical
/// noise of such scanners and the incidence. Pixels without a surface around them (edges, single points) are dropped.
/// `projection`: orthographic, of `depth`'s size.
RangeImage range_image_of_grid(const Projection& projection, const Transform& camera_from_pose, const cv::Mat1f& depth);

}  // namespace scanrig
