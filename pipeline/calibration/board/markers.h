#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/result.h"

/// OpenCV's markers (ArUco), the same for 4.6 and for 4.7 and later. Only markers: OpenCV's own ChArUco corners are
/// half a pixel off (opencv issue 25539). Threads: any.
namespace scanrig {

/// A marker in an image.
struct FoundMarker {
  int id = 0;
  /// Upper left, upper right, lower right, lower left on the print; pixel centres at integer coordinates; to about a
  /// pixel.
  std::array<Eigen::Vector2d, 4> corners;
};

/// Number of markers in a dictionary such as "4x4_100". Fails with `invalid_input` for an unknown one.
Result<int> marker_count(const std::string& dictionary);

/// Cells of a marker as printed, its black border of one cell included: 255 white, 0 black. Fails with `invalid_input`.
Result<cv::Mat1b> marker_bits(const std::string& dictionary, int id);

/// Every marker of `dictionary` in a grey image of 8 bit, by id. An id seen twice is left out. Fails with
/// `invalid_input`, and with `internal` when OpenCV does.
Result<std::vector<FoundMarker>> detect_markers(const cv::Mat1b& grey, const std::string& dictionary);

}  // namespace scanrig
