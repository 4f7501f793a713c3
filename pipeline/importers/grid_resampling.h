#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/importers/stanford_files.h"

namespace scanrig {

/// A scan on a regular grid.
struct ResampledGrid {
  Projection grid;  ///< orthographic
  Transform camera_from_scan = Transform::Identity();
  cv::Mat1f depth;  ///< mm along the scanner's rays; NaN where unknown
};

/// Resamples linearly over the triangles between neighbouring cells; no triangle spans a depth step.
/// Fails with `degenerate` (no four neighbouring cells).
Result<ResampledGrid> resample(const RangeGrid& scan);

}  // namespace scanrig
