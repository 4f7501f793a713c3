#include "pipeline/range/compact_range.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace scanrig {
namespace {

/// A part of every kind: rows without a measured pixel, gaps, background, more than one word a row.
RangeImage some_range(float nearest, float farthest) {
  constexpr int kWidth = 150, kHeight = 40;
  RangeImage range;
  range.projection = {.width = kWidth, .height = kHeight, .fx = 300, .fy = 300, .cx = 70, .cy = 20};
  range.depth = cv::Mat1f(kHeight, kWidth, kUnmeasured);
  range.sigma = range.depth.clone();
  range.normal = cv::Mat3f(kHeight, kWidth, cv::Vec3f(kUnmeasured, kUnmeasured, kUnmeasured));
  range.background = cv::Mat1b(kHeight, kWidth, uchar{0});
  std::mt19937 random(1);
  std::uniform_real_distribution<float> depth(nearest, farthest), sigma(0.002F, 0.4F), slope(-0.9F, 0.9F), chance(0, 1);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const float kind = chance(random);
      if (kind < 0.2F) range.background(v, u) = 255;
      if (kind < 0.4F || v % 7 == 3) continue;
      range.depth(v, u) = depth(random);
      range.sigma(v, u) = sigma(random);
      range.normal(v, u) = cv::normalize(cv::Vec3f(slope(random), slope(random), -1.0F));
    }
  }
  return range;
}

template <typename Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  if (a.size() != b.size()) return false;
  for (int v = 0; v < a.rows; ++v) {
    if (std::memcmp(a[v], b[v], static_cast<std::size_t>(a.cols) * a.elemSize()) != 0) return false;
  }
  return true;
}

double degrees_between(const cv::Vec3f& a, const cv::Vec3f& b) {
  return 2.0 * std::asin(0.5 * cv::norm(cv::Vec3d(a) - cv::Vec3d(b))) * 57.2957795;
}

TEST(CompactRange, KeepsDepthAndBackgroundAndAlmostSigmaAndNormal) {
  const RangeImage range = some_range(510.0F, 690.0F);
  const CompactRange compact(range);
  const RangeImage back = compact.whole();
  EXPECT_TRUE(same_bits(back.depth, range.depth));
  EXPECT_TRUE(same_bits(back.background, range.background));
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      ASSERT_EQ(std::isnan(back.sigma(v, u)), std::isnan(range.depth(v, u)));
      if (std::isnan(range.depth(v, u))) continue;
      EXPECT_NEAR(back.sigma(v, u), range.sigma(v, u), 2.5e-4F * range.sigma(v, u));
      EXPECT_LT(degrees_between(back.normal(v, u), range.normal(v, u)), 0.06);
    }
  }
}

TEST(CompactRange, DepthsFarApartLoseAPartInFourMillions) {
  const RangeImage range = some_range(100.0F, 790.0F);
  const RangeImage back = CompactRange(range).whole();
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      if (!std::isnan(range.depth(v, u))) EXPECT_NEAR(back.depth(v, u), range.depth(v, u), 2.4e-7F * range.depth(v, u));
    }
  }
}

TEST(CompactRange, APartHasTheBitsOfTheWhole) {
  const CompactRange compact(some_range(510.0F, 690.0F));
  const RangeImage whole = compact.whole();
  for (const cv::Rect box : {cv::Rect(0, 0, 150, 40), cv::Rect(63, 5, 2, 30), cv::Rect(64, 0, 86, 1),
                             cv::Rect(130, 39, 20, 1), cv::Rect(17, 3, 100, 8)}) {
    const RangeImage part = compact.part(box);
    EXPECT_TRUE(same_bits(part.depth, whole.depth(box)));
    EXPECT_TRUE(same_bits(part.sigma, whole.sigma(box)));
    EXPECT_TRUE(same_bits(part.normal, whole.normal(box)));
    EXPECT_TRUE(same_bits(part.background, whole.background(box)));
    EXPECT_EQ(part.projection.width, box.width);
    EXPECT_DOUBLE_EQ(part.projection.cx, 70.0 - box.x);
  }
}

TEST(CompactRange, CompactedAgainItStaysAsItIs) {
  for (const float farthest : {690.0F, 4000.0F}) {
    const RangeImage once = CompactRange(some_range(310.0F, farthest)).whole();
    const RangeImage twice = CompactRange(once).whole();
    EXPECT_TRUE(same_bits(once.depth, twice.depth));
    EXPECT_TRUE(same_bits(once.sigma, twice.sigma));
    EXPECT_TRUE(same_bits(once.normal, twice.normal));
  }
}

TEST(CompactRange, TakesEightBytesAMeasuredPixelAndTwoBitsAPixel) {
  const RangeImage range = some_range(510.0F, 690.0F);
  const CompactRange compact(range);
  std::size_t measured = 0;
  for (const float depth : range.depth) measured += std::isnan(depth) ? 0 : 1;
  EXPECT_EQ(compact.measured(), measured);
  EXPECT_LT(compact.bytes(), 8 * measured + range.depth.total() / 2);
}

TEST(CompactRange, NothingMeasuredAndNoBackground) {
  RangeImage range = some_range(510.0F, 690.0F);
  range.depth.setTo(kUnmeasured);
  range.background = cv::Mat1b();
  const RangeImage back = CompactRange(range).whole();
  EXPECT_TRUE(same_bits(back.depth, range.depth));
  EXPECT_TRUE(back.background.empty());
}

}  // namespace
}  // namespace scanrig
