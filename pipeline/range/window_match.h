#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "pipeline/range/spline.h"

namespace scanrig {

/// Disparity around a pixel, second order: u_here - u_there = c0 + c1 x + c2 y + c3 x^2 + c4 x y + c5 y^2, where x, y
/// are the pixels from it. Windows reach `radius` pixels to each side.
struct DisparityPatch {
  std::array<float, 6> c{};
  float sigma = 0.0f;  ///< of c0, px
  float zncc = 0.0f;
  float residual = 0.0f;  ///< variance of what the patch leaves unexplained, grey values squared
  float gain = 1.0f;      ///< of the other image's values
  float centre = 0.0f;    ///< variance of the residual in the middle of the window, in units of that of the whole
  std::uint8_t radius = 0;
  bool valid = false;

  [[nodiscard]] float at(float x, float y) const {
    return c[0] + x * (c[1] + c[3] * x + c[4] * y) + y * (c[2] + c[5] * y);
  }
  /// The same surface, described around the pixel (x, y) away.
  [[nodiscard]] DisparityPatch moved(float x, float y) const {
    DisparityPatch p = *this;
    p.c[0] = at(x, y);
    p.c[1] += 2.0f * c[3] * x + c[4] * y;
    p.c[2] += 2.0f * c[5] * y + c[4] * x;
    return p;
  }
};

/// One image of a rectified pair, prepared for matching.
struct MatchImage {
  explicit MatchImage(const cv::Mat1f& image);
  cv::Mat1f value;
  CubicRows cubic;
  cv::Mat1f slope;  ///< d value / du
};

/// Constraints on the pixels of the image that the matcher starts from.
struct MatchMask {
  cv::Mat1b usable;     ///< not 0: shows the object
  cv::Mat1f disparity;  ///< coarse, px; NaN unknown; keeps pixels beyond a depth step out of a window
};

/// Of the rows that a window uses. Large ones lie on smoothed images, whose rows repeat each other: every second tells
/// nearly as much, in half the time.
constexpr int rows_apart(int radius) { return radius >= 10 ? 2 : 1; }

struct WindowOptions {
  int max_iterations = 8;        ///< Gauss-Newton steps
  double precision_px = 3e-3;    ///< a smaller step ends the iteration
  float step_px = 1.0f;          ///< a coarse disparity farther than this from the patch belongs to another surface
  bool unknown_joins = false;    ///< pixels without a coarse disparity belong to the patch
  float min_support = 0.45f;     ///< share of the window that must belong to the patch
  float significance = 2.0f;     ///< a window's correlation must be so many times that of unlike images
  float curvature_prior = 0.5f;  ///< px over a window of radius 7: a second order is worth its noise only if it differs
                                 ///< from `curvature` by more
  std::array<float, 3> curvature{};  ///< c3 to c5 as they are known from elsewhere
};

/// Least-squares matching of the window around (u, v) with second-order shape, gain and offset [Sutton, Orteu and
/// Schreier, Image Correlation, 2009, ch. 5]: Gauss-Newton from `patch`, with the gradient of `here` (inverse
/// compositional). `patch.radius` is 5, 7, 10 or 15. Returns the patch where it stopped; invalid when it diverged, had
/// too little signal or a correlation that unlike images have by chance: 1 / sqrt(n) for n independent samples, of
/// which an image has one per pi l^2 pixels, l being its correlation length (rms of the values by that of their slope).
DisparityPatch match_window(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                            const DisparityPatch& patch, const WindowOptions& options);

/// Sets of instructions that match_window() is compiled for, the best last. All give the same bits.
enum class Instructions : std::uint8_t { baseline, avx2 };
/// Those of this processor, `baseline` first.
std::vector<Instructions> available_instructions();
/// For tests and measurements: the best is used from the start. Must be available.
void use_instructions(Instructions instructions);

/// What a patch leaves unexplained of its window, grey values, and d value / du there; row by row, `side` each way.
struct WindowResidual {
  int side = 0;
  std::vector<float> residual, slope;
  std::vector<std::uint8_t> used;  ///< 0: left out
};
WindowResidual window_residual(const MatchImage& here, const MatchImage& there, const MatchMask& mask, int u, int v,
                               const DisparityPatch& patch, const WindowOptions& options);

}  // namespace scanrig
