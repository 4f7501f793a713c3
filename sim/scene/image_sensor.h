#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "sim/scene/effects.h"

namespace scanrig::sim {

/// The light (32-bit float RGB, 1.0 = full scale) behind lens and colour filters (RGGB): one channel, 32-bit float.
/// `image_scale`: resolution as a share of the full sensor's; the blur is that of the full sensor. `extra_sigma_px`:
/// blur of a lens out of focus besides; `sigma_px`: the lens's own. Both in pixels of the full sensor.
cv::Mat through_lens(const cv::Mat& light, double image_scale, double extra_sigma_px = 0.0,
                     double sigma_px = profile().lens_sigma_px);

/// One camera's sensor.
/// Threads: const functions from any.
class ImageSensor {
 public:
  /// Without arguments: that of profile 1. The errors of each pixel and column are those of that camera, always.
  explicit ImageSensor(const Effects& effects = {}, bool is_left = true, const PixelCoding& coding = {})
      : effects_(effects), is_left_(is_left), coding_(coding) {}

  /// The image of the light behind the filters: vignetting, cross-talk, gains, shot and read noise, offsets.
  /// `noise_key` names the exposure: the same key gives the same noise; 0 gives none. `noise_factor`: of its standard
  /// deviation.
  [[nodiscard]] cv::Mat expose(const cv::Mat& on_sensor, std::uint64_t noise_key, double noise_factor = 1.0) const;

  /// Grey level of 255 that exposure `noise_key` adds to all pixels, and what pixel (x, y) always has beside that.
  [[nodiscard]] double black_of(std::uint64_t noise_key) const;
  [[nodiscard]] double hot_excess(int x, int y) const;

 private:
  [[nodiscard]] cv::Mat cross_talked(const cv::Mat& on_sensor) const;

  Effects effects_;
  bool is_left_;
  PixelCoding coding_;
};

}  // namespace scanrig::sim
