#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig::bench {

/// An image whose rows are moved by row_field() of up to `rows_px` pixels: what was in row v appears in v + field.
cv::Mat1f with_moved_rows(const cv::Mat1f& image, double rows_px);

/// A Middlebury pair with true disparities to a quarter of a pixel (im2, im6, disp2, disp6 in `folder`), matched by
/// match_rectified() and by OpenCV's MODE_HH: figures of DisparityFigures for each, and `bad_1`, the share of pixels
/// that both images see, 16 px inside the left image's search margin, that are unmeasured or more than 1 px off.
/// Fails with `not_found` and as matching does.
Result<nlohmann::json> measure_middlebury(const std::filesystem::path& folder, double rows_px);

/// The D415 pair of tests/bench/real_data/d415_measure.h, its right image's rows moved: rms_px, coverage, seconds.
Result<nlohmann::json> measure_sheet(const std::filesystem::path& folder, double rows_px);

}  // namespace scanrig::bench
