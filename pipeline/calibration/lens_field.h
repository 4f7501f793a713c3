#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace scanrig {

/// The sixteen coefficients of a lens field that act on one pixel, and how much: column + 7 * row of the first one,
/// weights across and down and their derivatives per pixel.
struct LensFieldSupport {
  int first = 0;
  std::array<double, 4> across{}, down{};
  std::array<double, 4> across_slope{}, down_slope{};

  /// Place of the coefficient `column` and `row` (0 to 3) after the first one.
  [[nodiscard]] std::size_t coefficient(int column, int row) const;
};

/// What a lens does beyond Brown's five coefficients: a smooth shift of pixels, added to the pixel that Brown's
/// coefficients give. A uniform cubic B-spline: 5 x 4 knots span the image, and 7 x 6 coefficients lie around them.
/// Beyond the image the shift at its border holds. Threads: a value.
struct LensField {
  static constexpr int kColumns = 7;
  static constexpr int kRows = 6;
  static constexpr int kCount = kColumns * kRows;

  int width = 0;                              ///< of the image, pixels
  int height = 0;                             ///< likewise
  std::array<Eigen::Vector2d, kCount> shift;  ///< coefficients (du, dv), pixels, row after row

  LensField() { shift.fill(Eigen::Vector2d::Zero()); }
  /// The shift of a pixel (pixel centres at integers) and, where wanted, its derivative.
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& pixel, Eigen::Matrix2d* slope = nullptr) const;
  /// The pixel that the field shifts to `pixel`, to 1e-10 px. The field must be smaller than its knots are apart.
  [[nodiscard]] Eigen::Vector2d source_of(const Eigen::Vector2d& pixel) const;
  static LensFieldSupport support(const Eigen::Vector2d& pixel, int width, int height);
};

inline std::size_t LensFieldSupport::coefficient(int column, int row) const {
  const int place = first + column + LensField::kColumns * row;
  return static_cast<std::size_t>(place);
}

}  // namespace scanrig
