#include "pipeline/texture/shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace scanrig {
namespace {

/// IEC 61966-2-1, from an encoded value to a linear one.
double linear_of(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

int byte_of(double linear) { return to_srgb(Eigen::Vector3f::Constant(static_cast<float>(linear)))[1]; }

TEST(ShadingTest, anSrgbByteBeginsHalfALevelBelowItsValue) {
  for (int byte = 1; byte < 256; ++byte) {
    const double start = linear_of((byte - 0.5) / 255.0);
    EXPECT_EQ(byte_of(start - 1e-6), byte - 1);
    EXPECT_EQ(byte_of(start + 1e-6), byte);
  }
}

TEST(ShadingTest, whatIsBeyondBlackAndWhiteIsBlackOrWhite) {
  EXPECT_EQ(byte_of(0.0), 0);
  EXPECT_EQ(byte_of(-3.0), 0);
  EXPECT_EQ(byte_of(std::numeric_limits<double>::quiet_NaN()), 0);
  EXPECT_EQ(byte_of(1.0), 255);
  EXPECT_EQ(byte_of(std::numeric_limits<double>::infinity()), 255);
}

}  // namespace
}  // namespace scanrig
