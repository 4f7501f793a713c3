#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

struct RectifiedPair;

/// Row offset of a part of the image: v_right - v_left of the same surface, rectified pixels.
struct RowOffset {
  double u = 0.0, v = 0.0;  ///< left image, pixels
  double depth = 0.0;       ///< of the surface there, z in the left rectified frame, mm
  double offset_px = 0.0;
  double sigma_px = 0.0;
};

/// How far the rows of a rectified pair are from corresponding. 0 everywhere when the calibration still holds.
struct RowOffsets {
  int windows = 0;  ///< measured; 0: too few for a field, nothing else is valid
  /// f0 + f1 x + f2 y + f3 x^2 + f4 x y + f5 y^2, x and y from the image's middle in halves of its size; pixels.
  std::array<double, 6> field{};
  double sigma_px = 0.0;         ///< of the field, rms over the windows
  std::vector<RowOffset> cells;  ///< means of the windows the field explains, row by row

  [[nodiscard]] double at(double u, double v, cv::Size image) const;
};

struct RowOffsetOptions {
  int stride_px = 12;         ///< of the windows
  float max_sigma_px = 0.1F;  ///< of a disparity: windows around others are not measured
  double min_filled = 0.8;    ///< share of a window's pixels that have a disparity
  double max_offset_px = 1.0;
  int min_windows = 40;
  int cells = 5;  ///< along each side of the image
  int min_cell_windows = 8;
};

/// Measures the row offsets of a matched pair: in windows of 13 x 13 px, with the disparities as matched, shift, gain
/// and offset by least squares; then a smooth field over the windows, robustly. `disparity` and `sigma` are on the left
/// image's pixels, u_left - u_right, NaN unknown.
/// Threads: spread over the current arena, same bits for any number.
RowOffsets find_row_offsets(const RectifiedPair& pair, const cv::Mat1f& disparity, const cv::Mat1f& sigma,
                            const RowOffsetOptions& options = {});

}  // namespace scanrig
