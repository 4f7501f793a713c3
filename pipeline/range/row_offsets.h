#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
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

/// A smooth field of row offsets over the pixels of one image, px:
/// f0 + f1 x + f2 y + f3 x^2 + f4 x y + f5 y^2, x and y from the image's middle in halves of its size.
struct RowField {
  std::array<double, 6> terms{};
  [[nodiscard]] double at(double u, double v, cv::Size image) const;
  [[nodiscard]] bool is_zero() const { return terms == std::array<double, 6>{}; }
};

/// How far the rows of a rectified pair are from corresponding. 0 everywhere when the calibration still holds.
struct RowOffsets {
  int windows = 0;               ///< measured; 0: too few for a field, nothing else is valid
  RowField left_field;           ///< on the left image's pixels
  RowField right_field;          ///< the same on the right image's
  RowField corrected;            ///< on the right image's pixels: the part of it that was taken out before matching
  double largest_px = 0;         ///< of the field where it was measured
  double explained = 0;          ///< share of the windows that the field explains
  double sigma_px = 0.0;         ///< of the field, rms over the windows
  std::vector<RowOffset> cells;  ///< means of the windows the field explains, row by row

  [[nodiscard]] double at(double u, double v, cv::Size image) const { return left_field.at(u, v, image); }
};

/// For the person at the rig: empty below half a pixel, where the match's own correction is enough.
std::string row_warning(const RowOffsets& offsets);

struct RowOffsetOptions {
  int stride_px = 12;         ///< of the windows
  float max_sigma_px = 0.1F;  ///< of a disparity: windows around others are not measured
  double min_filled = 0.8;    ///< share of a window's pixels that have a disparity
  double max_offset_px = 1.0;
  int min_windows = 40;
  int cells = 5;  ///< along each side of the image
  int min_cell_windows = 8;
  bool is_coarse = false;  ///< disparities are of coarse matching: each window takes the plane through its own
};

/// Measures the row offsets of a matched pair: in windows of 13 x 13 px, with the disparities as matched, shift, gain
/// and offset by least squares; then a smooth field over the windows, robustly. `disparity` and `sigma` are on the left
/// image's pixels, u_left - u_right, NaN unknown. `corrected`: the field by which the rows of `pair.right` were moved
/// before; what is returned contains it.
/// Threads: spread over the current arena, same bits for any number.
RowOffsets find_row_offsets(const RectifiedPair& pair, const cv::Mat1f& disparity, const cv::Mat1f& sigma,
                            const RowOffsetOptions& options = {}, const RowField& corrected = {});

/// Single windows' offsets become a field: see find_row_offsets(). `u`, `v` on the left image, `u_right` on the right.
struct RowSample {
  float u = 0, v = 0, u_right = 0, depth = 0, offset = 0, sigma = 0;
};
RowOffsets fit_row_offsets(const std::vector<RowSample>& samples, cv::Size image, const RowOffsetOptions& options);

}  // namespace scanrig
