#include "pipeline/range/row_offsets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "core/parallel.h"
#include "pipeline/range/stereo.h"
#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

const cv::Size kSize(400, 320);
constexpr double kFocal = 4266.7;

/// A ball before the default rig, whose right camera has turned since it was calibrated; radians, about its own axes.
RangeImage matched(const Eigen::Vector3d& turn, double noise = 2.0) {
  const Calibration calibration = test::default_rig(kSize);
  Camera right = calibration.right;
  right.camera_from_turntable = small_motion(turn, Eigen::Vector3d::Zero()) * right.camera_from_turntable;
  const auto surface = test::ball({0, 45, 0}, 20);
  const auto rectification = *rectify(calibration, {25.0, 90.0});
  test::Look look;
  look.noise = noise;
  const cv::Mat3b left_image = test::render(calibration.left, surface, look);
  look.seed = 2;
  const cv::Mat3b right_image = test::render(right, surface, look);
  const cv::Mat1f depth = test::true_depth(rectification.left, rectification.left_from_turntable, surface);
  cv::Mat1b object;
  cv::compare(depth, depth, object, cv::CMP_EQ);
  auto range = match_stereo(rectification, left_image, right_image, object, {}, {}, {});
  EXPECT_TRUE(range) << range.error().message;
  return range ? *range : RangeImage();
}

double mean_of_cells(const RowOffsets& offsets) {
  double sum = 0.0;
  for (const RowOffset& cell : offsets.cells) sum += cell.offset_px;
  return sum / static_cast<double>(offsets.cells.size());
}

TEST(RowOffsets, OfACalibrationThatHoldsAreZero) {
  const RowOffsets offsets = matched({0, 0, 0}).row_offsets;
  ASSERT_GT(offsets.windows, 300);
  ASSERT_GE(offsets.cells.size(), 6u);
  for (const RowOffset& cell : offsets.cells) EXPECT_NEAR(cell.offset_px, 0.0, 0.01) << cell.u << " " << cell.v;
  EXPECT_NEAR(mean_of_cells(offsets), 0.0, 0.003);
  EXPECT_LT(offsets.sigma_px, 0.005);
}

/// A turn about the camera's x axis by w moves its image by f w across rows.
TEST(RowOffsets, OfATurnedCameraAreMeasuredToHundredthsOfAPixel) {
  for (const double px : {0.1, -0.4}) {
    const RowOffsets offsets = matched({-px / kFocal, 0, 0}).row_offsets;
    ASSERT_GT(offsets.windows, 250);
    EXPECT_NEAR(mean_of_cells(offsets), px, 0.005);
    EXPECT_NEAR(offsets.at(200, 160, kSize), px, 0.006);
    for (const RowOffset& cell : offsets.cells) {
      EXPECT_NEAR(cell.offset_px, px, 0.015);
      EXPECT_NEAR(cell.offset_px, px, 5.0 * cell.sigma_px);
    }
  }
}

TEST(RowOffsets, OfARolledCameraGrowAcrossTheImage) {
  constexpr double kRoll = 1e-3;  // 0.1 px at 100 px from the middle
  const RowOffsets offsets = matched({0, 0, kRoll}).row_offsets;
  ASSERT_GT(offsets.windows, 300);
  const auto rectification = *rectify(test::default_rig(kSize), {25.0, 90.0});
  const Projection &left = rectification.left, &right = rectification.right;
  for (const RowOffset& cell : offsets.cells) {
    const double disparity = left.fx * rectification.baseline_mm / cell.depth + left.cx - right.cx;
    EXPECT_NEAR(cell.offset_px, kRoll * (cell.u - disparity - 199.5), 0.01) << cell.u;
    EXPECT_NEAR(offsets.at(cell.u, cell.v, kSize), cell.offset_px, 0.01);
  }
}

TEST(RowOffsets, AreTheSameBitsForAnyNumberOfThreads) {
  RowOffsets first;
  for (const int threads : {1, 3}) {
    with_threads(threads, [&] {
      const RowOffsets offsets = matched({-0.1 / kFocal, 0, 0}).row_offsets;
      if (first.windows == 0) first = offsets;
      EXPECT_EQ(offsets.windows, first.windows);
      EXPECT_EQ(offsets.left_field.terms, first.left_field.terms);
      EXPECT_EQ(offsets.sigma_px, first.sigma_px);
    });
  }
}

TEST(RowOffsets, OfTooFewWindowsAreNone) {
  const Calibration calibration = test::default_rig(kSize);
  const auto rectification = *rectify(calibration, {25.0, 90.0});
  const cv::Mat1f image(kSize, 50.0F);
  const RectifiedPair pair{image, image, {}, {}, rectification.left, 0.0, 160.0, -20, 20};
  const cv::Mat1f unknown(kSize, std::nanf(""));
  EXPECT_EQ(find_row_offsets(pair, unknown, unknown).windows, 0);
  // Disparities everywhere, but nothing to see.
  EXPECT_EQ(find_row_offsets(pair, cv::Mat1f(kSize, 0.0F), cv::Mat1f(kSize, 0.02F)).windows, 0);
}

}  // namespace
}  // namespace scanrig
