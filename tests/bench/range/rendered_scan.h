#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>

#include "core/result.h"
#include "pipeline/evaluate/true_view.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/rectification.h"
#include "pipeline/storage/scan_folder.h"
#include "tests/bench/range/disparity_figures.h"

namespace scanrig::bench {

struct RenderedScan {
  ScanFolder scan;
  Rectification rectification;
  Truth truth;  ///< as the rectified cameras see it
};
Result<RenderedScan> open_rendered(const std::filesystem::path& folder);

/// A rule by which a TrueView counts every point that all three see, however steep and near to a step.
ObservableRule every_point();
/// Everything but `measured` and `sigma`.
DisparityPair true_disparities(const RenderedScan& scan, const TrueView& view);
/// A view's range image beside the truth.
DisparityPair compare(const RangeImage& range, const RenderedScan& scan, const TrueView& view);

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
