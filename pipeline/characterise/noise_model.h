#pragma once

#include <algorithm>

namespace scanrig {

/// Noise of a pixel by its grey value, as a camera's photon transfer gives it [EMVA 1288 release 4 linear, 2.2
/// and 2.4]. Grey values are those of the image file, linear in light, of whatever bit depth the model was made for.
struct NoiseModel {
  // As declared: assumed of an industrial camera of 8 bit at gain 1, about 10,000 electrons at full scale.
  double gain = 1.0 / 40.0;  ///< K: grey values per electron
  double black = 0.0;        ///< grey value without light
  double read_noise = 0.5;   ///< grey values, without that of rounding
  double prnu = 0.01;        ///< sigma of the pixels' gains, as a share
  double column = 0.0;       ///< sigma of the columns' offsets, grey values
  bool is_measured = false;  ///< of this camera; else the assumption above

  static constexpr double kRounding = 1.0 / 12.0;  ///< variance of a value rounded to whole numbers

  /// Of the same pixel from exposure to exposure, grey values squared: reading, photons, rounding.
  [[nodiscard]] double variance(double grey) const {
    return read_noise * read_noise + kRounding + gain * std::max(0.0, grey - black);
  }
  /// Of one pixel from its neighbours, the same in every exposure, grey values squared: gains of pixels, columns.
  [[nodiscard]] double fixed_variance(double grey) const {
    const double of_gain = prnu * std::max(0.0, grey - black);
    return of_gain * of_gain + column * column;
  }
};

}  // namespace scanrig
