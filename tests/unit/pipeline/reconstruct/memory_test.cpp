#include "pipeline/reconstruct/memory.h"

#include <gtest/gtest.h>

#include <vector>

namespace scanrig {
namespace {

constexpr double kGiB = 1U << 30;

Calibration rig(int width, int height) {
  Calibration calibration;
  calibration.left.projection = calibration.right.projection = {.width = width, .height = height};
  calibration.table_radius_mm = 90.0;
  return calibration;
}

TEST(Memory, TheShippedRigFitsIntoAGigabyte) {
  EXPECT_TRUE(check_memory(rig(1280, 960), 16, 0.25, std::uintmax_t{1} << 30));
}

TEST(Memory, WhatDoesNotFitIsRefusedWithTheRemedy) {
  const auto fits = check_memory(rig(1280, 960), 16, 0.05, std::uintmax_t{4} << 30);
  ASSERT_FALSE(fits);
  EXPECT_EQ(fits.error().code, ErrorCode::out_of_range);
  EXPECT_NE(fits.error().message.find("needs at least"), std::string::npos);
  EXPECT_NE(fits.error().message.find("use larger voxels or allow more"), std::string::npos);
}

TEST(Memory, TwelveMegapixelsOfAHundredMillimetresInTenthsFitIntoEightGigabytes) {
  EXPECT_TRUE(check_memory(rig(4096, 3072), 64, 0.1, std::uintmax_t{8} << 30));
}

TEST(Memory, FewerViewsAreMatchedAtOnceWhereThereIsLess) {
  const Calibration large = rig(4096, 3072);
  EXPECT_EQ(views_at_once(large, 64, std::uintmax_t{8} << 30, 2), 2U);
  EXPECT_EQ(views_at_once(large, 64, std::uintmax_t{4} << 30, 2), 1U);
  EXPECT_EQ(views_at_once(large, 64, 0, 2), 1U);
}

TEST(Memory, WhatThisProcessHoldsIsNotLeft) {
  EXPECT_EQ(memory_left(0), 0U);
  const auto before = static_cast<double>(memory_left(std::uintmax_t{64} << 30));
  const std::vector<char> held(std::size_t{256} << 20, 1);
  const auto after = static_cast<double>(memory_left(std::uintmax_t{64} << 30));
  EXPECT_EQ(held.back(), 1);
  EXPECT_NEAR((before - after) / kGiB, 0.25, 0.05);
}

}  // namespace
}  // namespace scanrig
