#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::bench {

/// A rectified pair in linear or camera-coded grey, 32-bit float, and which pixels of the left image count.
struct RealPair {
  std::string name;
  bool is_pattern = false;  ///< projected dots; else the surface's own texture
  cv::Mat left, right, mask;
  int min_disparity = 0, disparities = 128;
};

struct PairMeasure {
  double contrast = 0.0;  ///< median over windows of 15x15: standard deviation by mean
  double noise = 0.0;     ///< sigma by Immerkaer's operator where there is least detail, by the mean there
  std::array<double, 6> autocorrelation{};  ///< along the rows, of the high-passed image, at lags 1 to 6 px
  double zncc_p10 = 0.0, zncc_p50 = 0.0, zncc_p90 = 0.0;  ///< of windows of 9x9 at the disparity of OpenCV's SGBM
  std::array<double, 10> zncc_shares{};                   ///< below 0.5, then in steps of 0.05 to 0.9, and above
  int windows = 0;
};

/// Rendered scans, each of one view at least.
struct RenderedScans {
  std::filesystem::path laboratory, workshop, faint_dots;
};

/// The real pairs below `data` (D415 dots, teddy, cones), and pattern and plain of the first view of the rendered
/// scans, rectified by their true calibration, their part alone. Fails with `not_found`, `invalid_input`.
Result<std::vector<RealPair>> read_pairs(const std::filesystem::path& data, const RenderedScans& scans);

PairMeasure measure(const RealPair& pair);

}  // namespace scanrig::bench
