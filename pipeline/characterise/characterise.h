#pragma once

#include <limits>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/characterise/noise_model.h"

namespace scanrig {

/// Two raw images in the same light, one after the other.
struct FlatPair {
  std::string name;          ///< for messages: "left_2000us"
  double exposure_us = 0.0;  ///< 0: dark, the lens covered
  cv::Mat first, second;     ///< one channel, mono or Bayer, CV_8U or CV_16U
};

struct CharacteriseOptions {
  int bits = 8;        ///< of a value: full scale is 2^bits - 1
  double gamma = 1.0;  ///< exponent with which the camera codes its values, 0.45; images are made linear first
  int window_px = 33;  ///< of local means, in pixels of one colour: what is wider is paper and light, not sensor
};

struct HotPixel {
  int x = 0, y = 0;
  double excess = 0.0;  ///< grey values over its neighbours, in the dark
};

/// One exposure of the photon transfer curve.
struct TransferPoint {
  double exposure_us = 0.0;
  double grey = 0.0;      ///< mean
  double variance = 0.0;  ///< of a pixel in time
};

/// What a camera's images are worth. Grey values are those of the files, made linear.
struct SensorCharacterisation {
  std::string serial;
  std::string gain_setting;  ///< of the camera, as its configuration names it; empty: not known
  int width = 0, height = 0;
  int bits = 8;
  double gamma = 1.0;

  double gain = 0.0;        ///< K, grey values per electron
  double gain_sigma = 0.0;  ///< of its determination, noise alone
  double black = 0.0;       ///< grey value without light
  double read_noise = 0.0;  ///< grey values, without rounding; in the dark at once
  double prnu = 0.0;        ///< share, high-pass
  double dsnu = 0.0;        ///< sigma of the pixels' offsets in the dark, columns included, grey values
  double column = 0.0;      ///< sigma of the columns' offsets, grey values
  double row = 0.0;         ///< the same of rows
  /// Grey value at which it saturates; NaN: no flat reaches it.
  double saturation = std::numeric_limits<double>::quiet_NaN();
  double linearity_error = 0.0;  ///< largest deviation of the mean grey values from a line, as a share of it
  double light_change = 0.0;     ///< rms of the light from image to image, as a share: what linearity cannot see below
  std::vector<HotPixel> hot_pixels;  ///< brightest first
  std::vector<TransferPoint> curve;  ///< the darks first, then by exposure
  std::vector<std::string> remarks;  ///< for the operator, what could be better

  [[nodiscard]] NoiseModel noise_model() const;
  /// Electrons that saturate a pixel; NaN: not known.
  [[nodiscard]] double full_well() const { return (saturation - black) / gain; }
};

/// Photon transfer of one camera, after EMVA 1288 release 4 linear, for light that is not quite even: noise in time
/// from differences within pairs, and everything else, less their local means. Each of the four places of a 2 x 2
/// mosaic is taken for itself, so mono and Bayer are alike. Needs a dark pair and pairs of three exposures. Same input,
/// same bits. Fails with `invalid_input`: names the images, what is wrong and what to do. No pair, sizes or kinds that
/// differ, three channels, an exposure too long or too short, light that changed within a pair, gamma, noise that does
/// not grow with light.
Result<SensorCharacterisation> characterise(const std::vector<FlatPair>& pairs,
                                            const CharacteriseOptions& options = {});

}  // namespace scanrig
