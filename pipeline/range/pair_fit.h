#pragma once

#include <opencv2/core/mat.hpp>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/camera.h"

namespace scanrig {

/// How well two pattern images fit a calibration as its left and right camera.
struct PairFit {
  double matched = 0.0;    ///< share of the left image's pixels with a depth within the working volume
  double exchanged = 0.0;  ///< the same with both images exchanged
  double rows_px = 0.0;    ///< rms by which rows of the images miss each other; NaN: too little texture to measure it
};

/// Matches a pair of one moment (8 bit, BGR or grey, in the calibration's size) as it is, and exchanged. Only the right
/// order has rows that correspond and depths of the working volume, however the cameras are turned to each other.
/// Threads: spread over the current arena, same bits for any number.
/// Fails with `invalid_input` (a calibration or an image of another size), `out_of_range` (see rectify()), `stopped`.
Result<PairFit> fit_pair(const Calibration& calibration, const cv::Mat& left, const cv::Mat& right,
                         const Context& context = {});

}  // namespace scanrig
