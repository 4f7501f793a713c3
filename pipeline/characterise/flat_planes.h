#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "pipeline/characterise/characterise.h"

namespace scanrig::flats {

inline constexpr int kPlaces = 4;   ///< of a 2 x 2 mosaic
inline constexpr int kTilePx = 32;  ///< side of a tile of one place, pixels of that place

/// Values of full scale, linear: 0 to 2^bits - 1.
class Linear {
 public:
  explicit Linear(const CharacteriseOptions& options);
  [[nodiscard]] cv::Mat1f operator()(const cv::Mat& raw) const;
  /// Variance of rounding where the linear value is `grey`.
  [[nodiscard]] double rounding(double grey) const;
  [[nodiscard]] double full() const { return full_; }

 private:
  double full_, gamma_;
  std::vector<float> table_;
};

/// Every second pixel of every second row, from (place % 2, place / 2).
cv::Mat1f plane_of(const cv::Mat1f& image, int place);

/// Less the local mean; edges are mirrored.
cv::Mat1f high_pass(const cv::Mat1f& plane, int window);

/// Share of independent noise's variance that high_pass() leaves about the mean of a tile.
double passed_share(int window);

/// What a tile of one place says of a pair.
struct Tile {
  double grey = 0.0;        ///< mean of both images
  double variance = 0.0;    ///< in time, of one image
  double fixed = 0.0;       ///< variance of the high-passed mean of both images, noise in time taken off
  int pixels = 0;           ///< without those left out
  bool is_clipped = false;  ///< a pixel is at 0 or at full scale
};

/// Tiles of all places. `left_out`: nonzero where a pixel does not count; empty: all count.
std::vector<Tile> tiles_of(const FlatPair& pair, const Linear& linear, int window, const cv::Mat1b& left_out);

}  // namespace scanrig::flats
