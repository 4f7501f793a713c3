#include "pipeline/range/compact_range.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace scanrig {
namespace {

constexpr int kWordBits = 64;

/// Sigma as the upper part of a number's bits from 2^-20 on: 2048 steps an octave, 32 octaves.
constexpr std::uint32_t kSigmaBase = (127U - 20U) << 23;
constexpr int kSigmaShift = 12;

std::uint16_t sigma_code(float sigma) {
  const auto bits = static_cast<std::int64_t>(std::bit_cast<std::uint32_t>(std::max(sigma, 0.0F)));
  const std::int64_t steps = (bits - kSigmaBase + (1 << (kSigmaShift - 1))) >> kSigmaShift;
  return static_cast<std::uint16_t>(std::clamp<std::int64_t>(steps, 0, 0xFFFF));
}

float sigma_of(std::uint16_t code) {
  return std::bit_cast<float>(kSigmaBase + (static_cast<std::uint32_t>(code) << kSigmaShift));
}

/// The unit vectors on an octahedron [Cigolle et al. 2014], 12 bits for each of two coordinates. Towards the camera is
/// its middle.
constexpr float kNormalSteps = 4095.0F;

std::array<std::uint8_t, 3> normal_code(const cv::Vec3f& n) {
  const float scale = 1.0F / (std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]));
  float x = n[0] * scale, y = n[1] * scale;
  if (n[2] > 0.0F) {
    const float folded = (1.0F - std::abs(y)) * std::copysign(1.0F, x);
    y = (1.0F - std::abs(x)) * std::copysign(1.0F, y);
    x = folded;
  }
  const auto step = [](float at) {
    return static_cast<std::uint32_t>(std::lround(std::clamp(0.5F * (at + 1.0F), 0.0F, 1.0F) * kNormalSteps));
  };
  const std::uint32_t code = step(x) << 12 | step(y);
  return {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8), static_cast<std::uint8_t>(code >> 16)};
}

std::uint32_t number_of(const std::array<std::uint8_t, 3>& bytes) {
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8 | static_cast<std::uint32_t>(bytes[2]) << 16;
}

cv::Vec3f normal_of(const std::array<std::uint8_t, 3>& bytes) {
  const std::uint32_t code = number_of(bytes);
  float x = 2.0F * static_cast<float>(code >> 12) / kNormalSteps - 1.0F;
  float y = 2.0F * static_cast<float>(code & 0xFFFU) / kNormalSteps - 1.0F;
  const float z = std::abs(x) + std::abs(y) - 1.0F;
  if (z > 0.0F) {
    const float folded = (1.0F - std::abs(y)) * std::copysign(1.0F, x);
    y = (1.0F - std::abs(x)) * std::copysign(1.0F, y);
    x = folded;
  }
  const float length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

template <class Word>
bool has_bit(const Word* words, int u) {
  return (words[u / kWordBits] >> (u % kWordBits) & 1U) != 0;
}

}  // namespace

CompactRange::CompactRange(const RangeImage& range) : header_(range), has_background_(!range.background.empty()) {
  header_.depth = header_.sigma = cv::Mat1f();
  header_.normal = cv::Mat3f();
  header_.background = cv::Mat1b();
  const int rows = range.depth.rows, columns = range.depth.cols;
  words_per_row_ = static_cast<std::size_t>((columns + kWordBits - 1) / kWordBits);
  is_measured_.resize(words_per_row_ * static_cast<std::size_t>(rows));
  if (has_background_) is_background_.resize(is_measured_.size());
  std::uint32_t largest = 0;
  base_ = ~0U;
  std::size_t count = 0;
  for (const float depth : range.depth) {
    if (std::isnan(depth)) continue;
    ++count;
    base_ = std::min(base_, std::bit_cast<std::uint32_t>(depth));
    largest = std::max(largest, std::bit_cast<std::uint32_t>(depth));
  }
  while (count > 0 && (largest - base_) >> shift_ > 0xFFFFFFU) ++shift_;
  pixels_.reserve(count);
  for (int v = 0; v < rows; ++v) {
    first_of_row_.push_back(pixels_.size());
    const std::size_t row = static_cast<std::size_t>(v) * words_per_row_;
    for (int u = 0; u < columns; ++u) {
      const Word bit = Word{1} << (u % kWordBits);
      const std::size_t word = row + static_cast<std::size_t>(u / kWordBits);
      if (has_background_ && range.background(v, u) != 0) is_background_[word] |= bit;
      const float depth = range.depth(v, u);
      if (std::isnan(depth)) continue;
      is_measured_[word] |= bit;
      const std::uint32_t code = (std::bit_cast<std::uint32_t>(depth) - base_) >> shift_;
      pixels_.push_back({{static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8),
                          static_cast<std::uint8_t>(code >> 16)},
                         normal_code(range.normal(v, u)),
                         sigma_code(range.sigma(v, u))});
    }
  }
}

void CompactRange::expand_row(int v, const cv::Rect& box, RangeImage& part) const {
  const Word* measured = words(is_measured_, v);
  std::size_t at = first_of_row_[static_cast<std::size_t>(v)];
  for (int word = 0; word < box.x / kWordBits; ++word) at += static_cast<std::size_t>(std::popcount(measured[word]));
  if (const int before = box.x % kWordBits; before > 0) {
    at += static_cast<std::size_t>(std::popcount(measured[box.x / kWordBits] << (kWordBits - before)));
  }
  const int row = v - box.y;
  for (int u = box.x; u < box.br().x; ++u) {
    if (has_background_ && has_bit(words(is_background_, v), u)) part.background(row, u - box.x) = 255;
    if (!has_bit(measured, u)) continue;
    const Pixel& pixel = pixels_[at++];
    part.depth(row, u - box.x) = std::bit_cast<float>(base_ + (number_of(pixel.depth) << shift_));
    part.sigma(row, u - box.x) = sigma_of(pixel.sigma);
    part.normal(row, u - box.x) = normal_of(pixel.normal);
  }
}

RangeImage CompactRange::part(const cv::Rect& box) const {
  RangeImage part = header_;
  const Projection& all = header_.projection;
  if (box.size() != cv::Size(all.width, all.height)) {
    part.projection = all.cropped(box.x, box.y, box.width, box.height);
  }
  part.depth = cv::Mat1f(box.size(), kUnmeasured);
  part.sigma = cv::Mat1f(box.size(), kUnmeasured);
  part.normal = cv::Mat3f(box.size(), cv::Vec3f(kUnmeasured, kUnmeasured, kUnmeasured));
  if (has_background_) part.background = cv::Mat1b(box.size(), uchar{0});
  for (int v = box.y; v < box.br().y; ++v) expand_row(v, box, part);
  return part;
}

RangeImage CompactRange::whole() const { return part({0, 0, header_.projection.width, header_.projection.height}); }

std::size_t CompactRange::bytes() const {
  return pixels_.size() * sizeof(Pixel) + (is_measured_.size() + is_background_.size()) * sizeof(Word) +
         first_of_row_.size() * sizeof(std::size_t);
}

}  // namespace scanrig
