// What real pairs demand: rows that do not correspond, faint dots, depth steps, steep surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/range/stereo.h"
#include "tests/unit/pipeline/range/range_error.h"
#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

using test::RangeError;

const cv::Size kRealSize(400, 320);
const Eigen::Vector3d kAbove(0, 45, 0);

/// A surface before the default rig, whose right camera has turned by `rows_px` across its rows since its calibration.
struct RenderedPair {
  Rectification rectification;
  cv::Mat3b left, right;
  cv::Mat1f truth;
  cv::Mat1b object;

  RenderedPair(const test::Surface& surface, test::Look look, double rows_px = 0.0) {
    const Calibration calibration = test::default_rig(kRealSize);
    Camera turned = calibration.right;
    const double angle = -rows_px / turned.projection.fx;
    turned.camera_from_turntable = small_motion({angle, 0, 0}, Eigen::Vector3d::Zero()) * turned.camera_from_turntable;
    rectification = *rectify(calibration, {25.0, 90.0});
    left = test::render(calibration.left, surface, look);
    look.seed = 2;
    right = test::render(turned, surface, look);
    truth = test::true_depth(rectification.left, rectification.left_from_turntable, surface);
    cv::compare(truth, truth, object, cv::CMP_EQ);
  }
  [[nodiscard]] Result<RangeImage> match() const {
    return match_stereo(rectification, left, right, object, {}, {}, {});
  }
  [[nodiscard]] cv::Mat1b inner(int margin) const {
    cv::Mat1b out;
    cv::erode(object, out, cv::Mat::ones(2 * margin + 1, 2 * margin + 1, CV_8U));
    return out;
  }
  [[nodiscard]] RangeError error(const RangeImage& range, int margin) const {
    return test::compare(range, truth, inner(margin));
  }
};

TEST(RealPairs, RowsThatAreOffAreMeasuredAndTakenOut) {
  const auto ball = test::ball(kAbove, 20);
  const RenderedPair aligned(ball, {});
  const auto as_calibrated = aligned.match();
  ASSERT_TRUE(as_calibrated);
  EXPECT_TRUE(as_calibrated->row_offsets.corrected.is_zero());
  EXPECT_EQ(row_warning(as_calibrated->row_offsets), "");
  const RangeError good = aligned.error(*as_calibrated, 12);
  // Taking rows out leaves what the turn of a camera does along the rows, to the second order.
  constexpr double kAlongRows = 0.032;
  for (const double rows_px : {-0.4, 1.0, 2.5}) {
    const RenderedPair moved(ball, {}, rows_px);
    const auto range = moved.match();
    ASSERT_TRUE(range) << range.error().message;
    const RangeError c = moved.error(*range, 12);
    EXPECT_GT(c.coverage, 0.97 * good.coverage) << rows_px;
    EXPECT_LT(c.median, 1.1 * good.median + kAlongRows * std::abs(rows_px)) << rows_px;
    EXPECT_LT(std::abs(c.bias), 0.004 + kAlongRows * std::abs(rows_px)) << rows_px;  // no row offset is taken for depth
    EXPECT_NEAR(range->row_offsets.at(200, 160, kRealSize), rows_px, 0.02);
    EXPECT_NEAR(range->row_offsets.corrected.at(200, 160, kRealSize), rows_px, 0.1);
    EXPECT_EQ(row_warning(range->row_offsets).empty(), std::abs(rows_px) < 0.5) << rows_px;
  }
}

TEST(RealPairs, RowsTooFarOffRefuseTheCalibrationByName) {
  const RenderedPair moved(test::ball(kAbove, 20), {}, 5.0);
  const auto range = moved.match();
  ASSERT_FALSE(range);
  EXPECT_EQ(range.error().code, ErrorCode::refused);
  EXPECT_NE(range.error().message.find("calibration: rows of the right camera"), std::string::npos);
}

TEST(RealPairs, RowsAreTakenOutTheSameForAnyNumberOfThreads) {
  const RenderedPair moved(test::ball(kAbove, 12), {}, 0.7);
  cv::Mat1f first;
  for (const int threads : {1, 3}) {
    with_threads(threads, [&] {
      const auto range = moved.match();
      ASSERT_TRUE(range) << range.error().message;
      if (first.empty()) first = range->depth;
      EXPECT_EQ(std::memcmp(first.data, range->depth.data, first.total() * sizeof(float)), 0);
    });
  }
}

/// Dots that noise leaves a correlation of 0.6 to 0.8.
test::Look faint_dots() {
  test::Look look;
  look.room_light = 0.9;
  look.dot_light = 0.08;
  look.noise = 3.0;
  return look;
}

TEST(RealPairs, FaintDotsAreMeasuredWithAnHonestSigma) {
  const RenderedPair pair(test::ball(kAbove, 20), faint_dots());
  const auto range = pair.match();
  ASSERT_TRUE(range) << range.error().message;
  const RangeError c = pair.error(*range, 16);
  EXPECT_GT(c.coverage, 0.8);
  EXPECT_LT(c.gross, 0.003 + 0.02);
  EXPECT_GT(c.sigma_ratio, 0.8);
  EXPECT_LT(c.sigma_ratio, 1.25);
}

TEST(RealPairs, NoiseAloneIsNoSurface) {
  test::Look look;
  look.dots = false;
  const RenderedPair pair(test::ball(kAbove, 20), look);
  const auto range = pair.match();
  if (range) {
    EXPECT_LT(pair.error(*range, 12).coverage, 0.01);
  }
}

TEST(RealPairs, SteepSurfaceIsGrownInto) {
  const RenderedPair pair(test::cylinder(0, 0, 18), {});
  const auto range = pair.match();
  ASSERT_TRUE(range) << range.error().message;
  cv::Mat1b steep(kRealSize, std::uint8_t{0});
  const Eigen::Vector3d left = pair.rectification.left_from_turntable.inverse().translation(),
                        right = pair.rectification.right_from_turntable.inverse().translation();
  for (int v = 40; v < kRealSize.height - 40; ++v) {
    for (int u = 0; u < kRealSize.width; ++u) {
      const double z = static_cast<double>(pair.truth(v, u));
      if (std::isnan(z)) continue;
      const Eigen::Vector3d p =
          pair.rectification.left_from_turntable.inverse() * pair.rectification.left.unproject(u, v, z);
      const Eigen::Vector3d normal = Eigen::Vector3d(p.x(), 0, p.z()).normalized();
      const double worse = std::min((left - p).normalized().dot(normal), (right - p).normalized().dot(normal));
      if (worse < std::cos(to_radians(55.0)) && worse > std::cos(to_radians(70.0))) steep(v, u) = 255;
    }
  }
  ASSERT_GT(cv::countNonZero(steep), 1000);
  const RangeError c = test::compare(*range, pair.truth, steep);
  EXPECT_GT(c.coverage, 0.9);
  EXPECT_LT(c.median, 0.05);
}

TEST(RealPairs, ANarrowStripBeforeASlabIsMeasured) {
  const auto slab = test::strip({0, 45, 0}, 50, 40);
  const auto narrow = test::strip({0, 45, 6}, 4.2, 30);  // 28 px
  const RenderedPair pair(test::nearest_of(slab, narrow), {});
  const auto range = pair.match();
  ASSERT_TRUE(range) << range.error().message;
  cv::Mat1b on_strip(kRealSize, std::uint8_t{0});
  const Transform turntable_from_left = pair.rectification.left_from_turntable.inverse();
  for (int v = 0; v < kRealSize.height; ++v) {
    for (int u = 0; u < kRealSize.width; ++u) {
      const double z = static_cast<double>(pair.truth(v, u));
      if (!std::isnan(z) && (turntable_from_left * pair.rectification.left.unproject(u, v, z)).z() > 3.0) {
        on_strip(v, u) = 255;
      }
    }
  }
  const RangeError c = test::compare(*range, pair.truth, on_strip);
  EXPECT_GT(c.coverage, 0.75);
  EXPECT_LT(c.gross, 0.005);
}

}  // namespace
}  // namespace scanrig
