#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "pipeline/range/range_image.h"

namespace scanrig {

/// A range image in 8 bytes a measured pixel and two bits a pixel. Depth keeps its bits where the nearest and the
/// farthest are within a factor of 2, and is off by one part in four million where they are within 8. Sigma is off by
/// 0.025 %, the normal by less than 0.06 deg. What was compact once stays as it is when compacted again.
/// Depths must be positive. Threads: const functions from any.
class CompactRange {
 public:
  CompactRange() = default;
  explicit CompactRange(const RangeImage& range);

  [[nodiscard]] RangeImage whole() const;
  /// The pixels of `box`, which must lie in the image; with the projection of this part.
  [[nodiscard]] RangeImage part(const cv::Rect& box) const;
  [[nodiscard]] std::size_t measured() const { return pixels_.size(); }
  [[nodiscard]] std::size_t bytes() const;

  [[nodiscard]] const RangeImage& header() const { return header_; }  ///< all but the matrices
  void place(const Transform& camera_from_pose) { header_.camera_from_pose = camera_from_pose; }

 private:
  struct Pixel {
    std::array<std::uint8_t, 3> depth, normal;
    std::uint16_t sigma;
  };
  static_assert(sizeof(Pixel) == 8);
  using Word = std::uint64_t;

  [[nodiscard]] const Word* words(const std::vector<Word>& bits, int row) const {
    return bits.data() + static_cast<std::size_t>(row) * words_per_row_;
  }
  void expand_row(int v, const cv::Rect& box, RangeImage& part) const;

  RangeImage header_;
  bool has_background_ = false;
  std::size_t words_per_row_ = 0;
  std::vector<Word> is_measured_, is_background_;  ///< a bit a pixel
  std::vector<std::size_t> first_of_row_;          ///< in `pixels_`
  std::vector<Pixel> pixels_;                      ///< row by row
  std::uint32_t base_ = 0;                         ///< bits of the smallest depth
  int shift_ = 0;                                  ///< of the differences to it
};

}  // namespace scanrig
