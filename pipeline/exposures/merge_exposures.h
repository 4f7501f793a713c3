#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

#include "pipeline/characterise/noise_model.h"

namespace scanrig {

/// One grey value of the first exposure in a merged image: light of up to four times that exposure's full scale fits.
inline constexpr int kMergedUnitsPerGrey = 64;

struct OtherExposure {
  cv::Mat image;
  double factor = 1.0;  ///< how many times the duration of the first exposure it lasted, nominally
};

/// Line by which an exposure's grey values follow from the first one's: gain * first + offset.
struct ExposureLine {
  double gain = 1.0;
  double offset = 0.0;
};

/// Measured from the pixels that neither image has dark or saturated, since flashes differ and the black level drifts
/// [EMVA 1288 release 4 linear, 2.2: values are linear in exposure time]. Where these are too few, the nominal one of
/// `black`, the grey value without light.
ExposureLine line_between(const cv::Mat& first, const OtherExposure& other, double black);

/// One image of several exposures of the same light and the same moment: every value is the mean of those that are not
/// saturated, each weighted by its variance after `noise`; the shortest exposure's where all are. 16 bit, in
/// kMergedUnitsPerGrey of a grey value of `first`, black level included; linear in light if the sensor is.
/// `first`: 8 bit, any channels, a Bayer mosaic too. `others`: the same size and type, any factors but 1. Asserted.
/// Threads: spread over the current arena, same bits for any number.
/// After [Granados et al., Optimal HDR reconstruction with linear digital cameras, CVPR 2010, 3].
cv::Mat merge_exposures(const cv::Mat& first, std::span<const OtherExposure> others, const NoiseModel& noise);

}  // namespace scanrig
