#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig::bench {

/// Matches every view of a rendered scan and measures it against its truth: figures of DisparityFigures, `seconds` per
/// view, and `depth_median_mm`, `depth_p95_mm` of what is measured. `rows_px`: rows of the right images are moved by a
/// smooth field of up to this many pixels. Fails as reading and matching do.
Result<nlohmann::json> measure_scan(const std::filesystem::path& folder, double rows_px);

/// The first view of a rendered scan, rectified left image; NaN where nothing is measured.
struct MeasuredView {
  cv::Mat3b photograph;  ///< in plain light, linear
  cv::Mat1f depth_mm, sigma_mm;
  cv::Mat1f error_mm;  ///< of the depth, less its median: the frames of rig and truth differ by their calibration
};
Result<MeasuredView> first_view(const std::filesystem::path& folder);

}  // namespace scanrig::bench
