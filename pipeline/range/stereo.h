#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/rectification.h"

namespace scanrig {

/// Limits and steps of stereo matching; the defaults come from scans with known truth, see README.md.
struct StereoOptions {
  double left_right_px = 0.3;     ///< the match from the right image must come back this near, or within 3 sigma
  double max_sigma_px = 0.25;     ///< beyond it a pixel counts as not measured
  double max_centre = 2.5;        ///< residual variance of a window's middle over the whole's: else another surface
  float surface_px = 1.0f;        ///< nodes whose disparities differ by more lie on different surfaces
  double good_sigma_px = 0.08;    ///< a larger window is tried only above this
  double neighbour_px = 0.25;     ///< neighbours 4 px away must predict a pixel this well, or within 3 sigma
  int min_patch_px = 150;         ///< smaller islands are dropped
  double tolerance_sigmas = 3.0;  ///< "within 3 sigma" above
  double max_rows_px = 3.0;       ///< rows farther off are refused, see row_alignment.h

  // Windows; a radius is 5, 7, 10 or 15.
  std::array<std::uint8_t, 2> sharp_radii_px = {5, 7};
  std::array<std::uint8_t, 2> smooth_radii_px = {10, 15};  ///< for low signal, on smoothed images
  double smoothing_px = 0.7;                               ///< sigma of that smoothing
  float smooth_step_px = 1.5f;  ///< see WindowOptions: where the signal is low the coarse disparities are worse too
  float smooth_curvature_prior = 0.15f;  ///< see WindowOptions
  // Factors on sigma where too few windows are matched to measure them, see noise_correlation.h.
  float sharp_noise = 1.7f;
  float smooth_noise = 2.5f;
  float tilt = 0.6f;  ///< px of disparity per px at which sigma has grown by 1.4

  // Search.
  int left_node_stride_px = 4;        ///< grid of the patches matched first
  int right_node_stride_px = 4;       ///< the same in the right image
  int lattice_px = 3;                 ///< pixels this far apart are matched, and between them where surfaces bend
  float lattice_agree_px = 0.12f;     ///< neighbours on the lattice agree on a pixel between them within this,
  float lattice_agree_sigmas = 3.0f;  ///< and within so many sigma; else it is matched
  int coarse_iterations = 10;         ///< Gauss-Newton steps from a coarse disparity
  int node_iterations = 6;            ///< Gauss-Newton steps from a neighbouring patch
  int row_margin_px = 24;             ///< rows matched above and below the object
  int min_rows = 16;                  ///< of the object and this margin
  float coarse_left_right_px = 1.5f;  ///< coarse disparities of both images must agree within this
  float plane_same_px = 4.0f;         ///< disparity difference within one surface; slopes reach 0.7 px per px
  double min_plane_pixels = 30.0;

  // Outliers.
  int beside_px = 2;     ///< a pixel this near to a depth step is removed
  int apart_px = 4;      ///< distance of the neighbours that must predict a pixel
  double step_px = 1.5;  ///< px of disparity: a larger difference is a depth step
  int min_agreeing = 3;  ///< of 8 neighbours: one side of a corner
};

/// Two images whose rows correspond.
struct RectifiedPair {
  cv::Mat1f left, right;                ///< grey values, any scale of about 0..255
  cv::Mat1b left_object, right_object;  ///< not 0 on the object; empty: everywhere
  Projection left_projection;           ///< pinhole
  double right_cx = 0.0;                ///< px; the rest is as in the left image
  double baseline_mm = 0.0;             ///< the right camera's centre is at +x in the left camera's frame
  int min_disparity = 0;                ///< px, u_left - u_right
  int max_disparity = 0;
};

/// Depth of every object pixel of the left image: semi-global matching as a seed, then least-squares matching with
/// second-order shape functions, checked from the right image. `camera_from_pose` is left identity, `background` empty.
/// Sigma is of one pixel; errors of pixels closer than a window (11 px or more) are correlated.
/// Threads: spread over the current arena, same bits for any number.
/// Fails with `invalid_input` (sizes, no disparities to search), `degenerate` (nothing matched), `stopped`.
Result<RangeImage> match_rectified(const RectifiedPair& pair, const StereoOptions& options, const Context& context);

/// The same from the sensors' pattern images (8 bit or merged exposures, BGR or grey). Masks are in the rectified
/// grids.
Result<RangeImage> match_stereo(const Rectification& rectification, const cv::Mat& left_pattern,
                                const cv::Mat& right_pattern, const cv::Mat1b& left_object,
                                const cv::Mat1b& right_object, const StereoOptions& options, const Context& context);

}  // namespace scanrig
