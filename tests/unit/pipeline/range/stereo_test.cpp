#include "pipeline/range/stereo.h"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/range/window_match.h"
#include "tests/bench/real_data/d415_measure.h"
#include "tests/shared_data.h"
#include "tests/unit/pipeline/range/range_error.h"
#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

using test::RangeError;
using test::Surface;

cv::Mat1b where_known(const cv::Mat1f& depth) {
  cv::Mat1b known;
  cv::compare(depth, depth, known, cv::CMP_EQ);
  return known;
}

/// Within 2 px of a bend of the surface, steps apart.
cv::Mat1b where_bent(const cv::Mat1f& depth) {
  cv::Mat1b bent(depth.size(), std::uint8_t{0});
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 2; u + 2 < depth.cols; ++u) {
      const float bend = depth(v, u - 1) - 2.0F * depth(v, u) + depth(v, u + 1);
      const float step = std::abs(depth(v, u + 1) - depth(v, u - 1));
      if (!(std::abs(bend) > 0.03F && step < 0.4F)) continue;  // false for NaN
      for (int x = u - 2; x <= u + 2; ++x) bent(v, x) = 255;
    }
  }
  return bent;
}

/// A rendered surface before the rectified default rig.
struct Scene {
  Rectification rectification;
  cv::Mat3b left, right;
  cv::Mat1f truth;
  cv::Mat1b object;

  explicit Scene(const Surface& surface, cv::Size size = {400, 320}) {
    const Calibration calibration = test::default_rig(size);
    rectification = *rectify(calibration, {25.0, 90.0});
    test::Look look;
    left = test::render(calibration.left, surface, look);
    look.seed = 2;
    right = test::render(calibration.right, surface, look);
    truth = test::true_depth(rectification.left, rectification.left_from_turntable, surface);
    object = where_known(truth);
  }
  [[nodiscard]] Result<RangeImage> match(const Context& context = {}) const {
    return match_stereo(rectification, left, right, object, {}, {}, context);
  }
  /// The object without `margin` pixels along its outline.
  [[nodiscard]] cv::Mat1b inner(int margin) const {
    cv::Mat1b out(object.size(), std::uint8_t{0});
    for (int v = margin; v + margin < object.rows; ++v) {
      for (int u = margin; u + margin < object.cols; ++u) {
        const cv::Rect around(u - margin, v - margin, 2 * margin + 1, 2 * margin + 1);
        out(v, u) = cv::countNonZero(object(around)) == around.area() ? 255 : 0;
      }
    }
    return out;
  }
};

const Eigen::Vector3d kMiddle(0, 45, 0);

TEST(Stereo, MeasuresABallToHundredthsOfAMillimetre) {
  const Scene scene(test::ball(kMiddle, 20));
  const auto range = scene.match();
  ASSERT_TRUE(range) << range.error().message;
  const RangeError c = test::compare(*range, scene.truth, scene.inner(12));
  EXPECT_LT(c.median, 0.01);
  EXPECT_LT(c.p95, 0.05);
  EXPECT_LT(std::abs(c.bias), 0.003);
  EXPECT_GT(c.coverage, 0.98);
  EXPECT_LT(test::compare(*range, scene.truth, scene.object).gross, 0.002);
}

TEST(Stereo, MeasuresSmallRadiiWithoutFlatteningThem) {
  const Scene scene(test::ball(kMiddle, 5), {240, 240});
  const auto range = scene.match();
  ASSERT_TRUE(range) << range.error().message;
  const RangeError c = test::compare(*range, scene.truth, scene.inner(8));
  EXPECT_LT(c.median, 0.015);
  EXPECT_LT(std::abs(c.bias), 0.006);
}

TEST(Stereo, MeasuresASurfaceThatTurnsAwayBySixtyDegrees) {
  const double angle = to_radians(60.0);
  const Scene scene(test::disc(kMiddle, {std::sin(angle), 0.0, std::cos(angle)}, 25));
  const auto range = scene.match();
  ASSERT_TRUE(range) << range.error().message;
  const RangeError c = test::compare(*range, scene.truth, scene.inner(10));
  EXPECT_LT(c.median, 0.02);
  EXPECT_LT(c.p95, 0.08);
  EXPECT_GT(c.coverage, 0.95);
}

TEST(Stereo, SigmaEqualsTheSizeOfTheErrors) {
  const Scene scene(test::disc(kMiddle, Eigen::Vector3d(0.3, 0.2, 1.0).normalized(), 22));
  const auto range = scene.match();
  ASSERT_TRUE(range) << range.error().message;
  const RangeError c = test::compare(*range, scene.truth, scene.object);
  // These images have no colour mosaic, whose correlated noise sigma allows for.
  EXPECT_GT(c.sigma_ratio, 0.4);
  EXPECT_LT(c.sigma_ratio, 1.2);
}

TEST(Stereo, NormalsAreTheSurfacesTowardsTheCamera) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.4, 0.3, 1.0).normalized();
  const Scene scene(test::disc(kMiddle, normal, 22));
  const auto range = scene.match();
  ASSERT_TRUE(range) << range.error().message;
  const Eigen::Vector3d expected = scene.rectification.left_from_turntable.linear() * normal;
  double worst = 0.0, sum = 0.0, count = 0.0;
  for (int v = 0; v < range->depth.rows; ++v) {
    for (int u = 0; u < range->depth.cols; ++u) {
      if (std::isnan(range->depth(v, u))) continue;
      const cv::Vec3f& n = range->normal(v, u);
      const Eigen::Vector3d got(static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2]));
      ASSERT_NEAR(got.norm(), 1.0, 1e-5);
      const double degrees = to_degrees(std::acos(std::min(1.0, got.dot(expected))));
      worst = std::max(worst, degrees);
      sum += degrees;
      count += 1.0;
    }
  }
  EXPECT_LT(sum / count, 1.5);
  EXPECT_LT(worst, 32.0);  // at the rim, from a window of one side
}

TEST(Stereo, PutsNothingBetweenTheTwoSidesOfADepthStep) {
  const Surface near_disc = test::disc({0, 52, 12}, {0, 0.37, 0.93}, 8);
  const Scene scene(test::nearest_of(test::disc(kMiddle, {0, 0.37, 0.93}, 24), near_disc));
  const auto range = scene.match();
  ASSERT_TRUE(range) << range.error().message;
  const RangeError c = test::compare(*range, scene.truth, scene.object);
  EXPECT_LT(c.gross, 0.003);
  EXPECT_GT(c.coverage, 0.75);
}

TEST(Stereo, GivesTheSameBitsForAnyNumberOfThreads) {
  const Scene scene(test::ball(kMiddle, 10), {280, 240});
  cv::Mat1f first;
  for (const int threads : {1, 2, 5}) {
    with_threads(threads, [&] {
      const auto range = scene.match();
      ASSERT_TRUE(range) << range.error().message;
      if (first.empty()) first = range->depth;
      EXPECT_EQ(std::memcmp(first.data, range->depth.data, first.total() * sizeof(float)), 0) << threads << " threads";
    });
  }
}

TEST(Stereo, GivesTheSameBitsForEverySetOfInstructions) {
  const Scene scene(test::ball(kMiddle, 10), {280, 240});
  const std::vector<Instructions> all = available_instructions();
  cv::Mat1f depth, sigma;
  for (const Instructions one : all) {
    use_instructions(one);
    const auto range = scene.match();
    use_instructions(all.back());
    ASSERT_TRUE(range) << range.error().message;
    if (depth.empty()) {
      depth = range->depth;
      sigma = range->sigma;
    }
    EXPECT_EQ(std::memcmp(depth.data, range->depth.data, depth.total() * sizeof(float)), 0) << static_cast<int>(one);
    EXPECT_EQ(std::memcmp(sigma.data, range->sigma.data, sigma.total() * sizeof(float)), 0) << static_cast<int>(one);
  }
}

TEST(Stereo, MatchesEveryPixelWhereTheSurfaceBends) {
  // A ridge of two planes: between matched pixels on both sides of it no mean of them lies on the surface.
  const Scene scene(test::nearest_of(test::disc({-9, 45, 0}, Eigen::Vector3d(-0.6, 0.3, 0.74).normalized(), 14),
                                     test::disc({9, 45, 0}, Eigen::Vector3d(0.6, 0.3, 0.74).normalized(), 14)));
  StereoOptions every;
  every.lattice_px = 1;
  const auto range = scene.match();
  const auto whole = match_stereo(scene.rectification, scene.left, scene.right, scene.object, {}, every, {});
  ASSERT_TRUE(range && whole);
  const cv::Mat1b ridge = where_bent(scene.truth);
  ASSERT_GT(cv::countNonZero(ridge), 300);
  const RangeError c = test::compare(*range, scene.truth, ridge), d = test::compare(*whole, scene.truth, ridge);
  EXPECT_LT(c.median, 1.03 * d.median);
  EXPECT_LT(c.p95, 1.08 * d.p95);
  EXPECT_GE(c.coverage, d.coverage - 0.005);
}

TEST(Stereo, ReportsImagesWithoutMatches) {
  const Scene scene(test::ball(kMiddle, 10), {280, 240});
  const cv::Mat3b dark(scene.left.size(), cv::Vec3b(3, 3, 3));
  const auto blank = match_stereo(scene.rectification, dark, dark, scene.object, {}, {}, {});
  ASSERT_FALSE(blank);
  EXPECT_EQ(blank.error().code, ErrorCode::degenerate);
  const cv::Mat1b nothing(scene.left.size(), std::uint8_t{0});
  const auto hidden = match_stereo(scene.rectification, scene.left, scene.right, nothing, {}, {}, {});
  ASSERT_FALSE(hidden);
  EXPECT_EQ(hidden.error().code, ErrorCode::degenerate);
}

TEST(Stereo, StopsOnRequest) {
  const Scene scene(test::ball(kMiddle, 10), {280, 240});
  std::stop_source stop;
  const auto at_half = [&](std::string_view, double fraction) {
    if (fraction >= 0.4) stop.request_stop();
  };
  const auto range = scene.match({stop.get_token(), at_half});
  ASSERT_FALSE(range);
  EXPECT_EQ(range.error().code, ErrorCode::stopped);
}

TEST(Stereo, RefusesInconsistentInputs) {
  const Scene scene(test::ball(kMiddle, 10), {280, 240});
  const cv::Mat1f image(240, 280, 50.0f);
  const RectifiedPair good{image, image, {}, {}, scene.rectification.left, 0.0, 160.0, -20, 20};
  RectifiedPair size = good, mask = good, baseline = good, disparities = good;
  size.right = cv::Mat1f(240, 200, 50.0f);
  mask.left_object = cv::Mat1b(10, 10, std::uint8_t{255});
  baseline.baseline_mm = 0.0;
  disparities.max_disparity = -20;
  for (const RectifiedPair& pair : {size, mask, baseline, disparities, RectifiedPair()}) {
    const auto range = match_rectified(pair, {}, {});
    ASSERT_FALSE(range);
    EXPECT_EQ(range.error().code, ErrorCode::invalid_input) << range.error().message;
  }
  const auto small = match_stereo(scene.rectification, cv::Mat3b(10, 10), scene.right, {}, {}, {}, {});
  ASSERT_FALSE(small);
  EXPECT_EQ(small.error().code, ErrorCode::invalid_input);
}

TEST(Stereo, MeasuresTheSheetOfARealDotPair) {
  const std::filesystem::path folder = shared_data() / "d415_ir_pair";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const auto result = bench::measure_d415(folder);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_LT(result->ours.rms_px, 0.20);
  EXPECT_GT(result->ours.coverage, 0.97);
  EXPECT_LE(result->ours.rim_smeared_px, result->sgbm.rim_smeared_px);
}

}  // namespace
}  // namespace scanrig
