#include "sim/scene/calibration_series.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/units.h"
#include "sim/scene/profile.h"
#include "sim/scene/rig_effects.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::unique_ptr<CalibrationSeries> made(const SeriesOptions& options) {
  return CalibrationSeries::create(options).value();
}

double largest_difference(const StereoImages& a, const StereoImages& b) {
  return std::max(cv::norm(a.left, b.left, cv::NORM_INF), cv::norm(a.right, b.right, cv::NORM_INF));
}

/// Largest shift of a corner between the truths of two series, over all images of both cameras.
double largest_shift(const CalibrationSeries& a, const CalibrationSeries& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.pairs().size(); ++i) {
    for (const bool left : {true, false}) {
      for (const int id : {0, 10, 40, 77, 87}) {
        const Vector2d off = a.corner_pixel(a.pairs()[i], left, id) - b.corner_pixel(b.pairs()[i], left, id);
        largest = std::max(largest, off.norm());
      }
    }
  }
  return largest;
}

TEST(Series, TakesFiftyPairsBySevenPlacements) {
  const auto series = made({});
  ASSERT_EQ(series->pairs().size(), 50U);
  int a = 0, b = 0;
  for (const auto& pair : series->pairs()) a += pair.in_a ? 1 : 0, b += pair.in_b ? 1 : 0;
  EXPECT_EQ(a, 29);
  EXPECT_EQ(b, 29);
  EXPECT_EQ(series->pairs().front().name, "placement1_01");
  EXPECT_EQ(series->pairs().back().name, "placement7_08");
}

TEST(Series, PutsTheBoardDownAsPlannedWithinTheErrorsOfAnOperator) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    const auto series = made({.rig = RigVariation{.reversed = seed == 3 ? 1.0 : 0.0}, .seed = seed});
    for (const auto& plan : calibration_plan()) {
      const auto middle = std::ranges::find_if(
          series->pairs(), [&](const SeriesPair& p) { return p.placement == plan.number && p.image == 4; });
      const Transform board = rot_y(to_radians(middle->true_deg)) * middle->table_from_board;
      const double tilt = to_degrees(std::acos(-board.linear().col(2).y()));
      if (plan.tilt_deg == 0.0) {
        EXPECT_LT(tilt, 0.2);
        EXPECT_LT(Vector2d(board.translation().x(), board.translation().z()).norm(), 15.2);
        continue;
      }
      // The fourth of seven images faces the cameras.
      EXPECT_NEAR(tilt, plan.tilt_deg, 10.2) << plan.number;
      EXPECT_LT(Vector2d(board.translation().x(), board.translation().z() - plan.front_mm).norm(), 15.2) << plan.number;
      const Vector3d facing = -board.linear().col(2);
      EXPECT_NEAR(to_degrees(std::atan2(facing.x(), facing.z())), 0.0, 10.3) << plan.number;
      const bool portrait = std::abs(board.linear().col(0).y()) > 0.3;
      EXPECT_EQ(portrait, plan.portrait) << plan.number;
      double lowest = 1e9;
      for (const double x : {-63.0, 63.0}) {
        for (const double y : {-48.0, 48.0}) lowest = std::min(lowest, (board * Vector3d(x, y, 3.0)).y());
      }
      EXPECT_NEAR(lowest, plan.on_block ? 40.0 : 0.0, 0.2) << plan.number;
    }
  }
}

TEST(Series, OfAWorkshopShowsTheTopLowerThanItIs) {
  SeriesOptions options;
  options.placements = {1};
  const auto flat = made(options);
  options.profile.effects =
      choose_effects("workshop", "optics,sensor,projector,materials,drift,room,runout,wobble,worm,tilt", "").value();
  const auto sunk = made(options);
  // Boards are where they were; rim dots are on the top, in a scan as in a calibration.
  EXPECT_LT(largest_shift(*flat, *sunk), 1e-6);
  EXPECT_DOUBLE_EQ(make_rig({}, options.profile.effects, 1.0).table.axis_from_top.translation().y(), 0.05);
  EXPECT_GT(largest_difference(flat->shoot(0), sunk->shoot(0)), 1.0);
}

TEST(Series, ReportsTheAngleOfADriveThatErrs) {
  const auto series = made({.rig = RigVariation{.gear = 1e-3, .reversed = 1.0}});
  double largest = 0.0;
  for (const auto& pair : series->pairs()) largest = std::max(largest, std::abs(pair.true_deg + pair.reported_deg));
  EXPECT_GT(largest, 0.01);
  EXPECT_LT(largest, 1.0);
}

TEST(Series, GivesTheSameBitsForAnyNumberOfThreadsAndAnyOrder) {
  const SeriesOptions options = {.rig = RigVariation{}, .image_scale = 0.25, .placements = {2, 7}, .angles = 2};
  std::array<StereoImages, 2> images;
  for (const int threads : {1, 2}) {
    with_threads(threads, [&] {
      const auto series = made(options);
      if (threads == 2) (void)series->shoot(4);
      images[threads - 1] = series->shoot(1);
    });
  }
  EXPECT_EQ(largest_difference(images[0], images[1]), 0.0);
}

TEST(Series, ShowsEveryErrorOfTheRigInTruthAndImage) {
  RigVariation none{.seed = 3};
  for (const auto& value : kRigVariationNames) none.*value.member = 0.0;
  SeriesOptions options = {.rig = none, .image_scale = 0.25, .placements = {1}, .angles = 3};
  const auto plain = made(options);
  const StereoImages seen = plain->shoot(2);
  const std::map<std::string, double> sizes = {{"residual", 0.5}, {"runout", 0.2}, {"top-tilt", 0.5},
                                               {"gear", 0.01},    {"angle", 0.5},  {"rim-dots", 0.5}};
  for (const auto& value : kRigVariationNames) {
    RigVariation one = none;
    one.*value.member = sizes.contains(value.name) ? sizes.at(value.name) : 1.0;
    options.rig = one;
    const auto series = made(options);
    EXPECT_GT(largest_difference(series->shoot(2), seen), 5.0) << value.name;
    const std::string name = value.name;
    if (name == "rim-dots") {
      EXPECT_GT(series->rig().rim_dots[3].norm(), 0.01);
    } else if (name == "noise") {
      EXPECT_GT(series->rig().noise_factor, 2.0);
    } else {
      EXPECT_GT(largest_shift(*series, *plain), 0.02) << name;
    }
  }
}

TEST(Series, ShowsAKnockedCameraAfterwardsOnly) {
  SeriesOptions options = {.rig = RigVariation{}, .angles = 1};
  const auto steady = made(options);
  options.faults.knock_px = 0.4;
  const auto knocked = made(options);
  int shifted = 0;
  for (std::size_t i = 0; i < steady->pairs().size(); ++i) {
    const auto off = [&](bool left) {
      return (knocked->corner_pixel(knocked->pairs()[i], left, 40) - steady->corner_pixel(steady->pairs()[i], left, 40))
          .norm();
    };
    EXPECT_EQ(std::min(off(true), off(false)), 0.0);
    const double moved = std::max(off(true), off(false));
    const int placement = steady->pairs()[i].placement;
    if (placement <= 2) {
      EXPECT_EQ(moved, 0.0);
    } else if (placement > 5) {
      EXPECT_NEAR(moved, 0.4, 0.02);
    }
    shifted += moved > 0.0 ? 1 : 0;
  }
  EXPECT_GE(shifted, 3);
}

TEST(Series, ShowsASlippedBoardAndAChangedFocus) {
  SeriesOptions options = {.rig = RigVariation{}, .angles = 3};
  const auto steady = made(options);
  options.faults.slip_mm = 0.5;
  const auto slipped = made(options);
  std::set<int> placements;
  for (std::size_t i = 0; i < steady->pairs().size(); ++i) {
    const auto& pair = slipped->pairs()[i];
    const double off = (pair.table_from_board.translation() - steady->pairs()[i].table_from_board.translation()).norm();
    if (off == 0.0) continue;
    EXPECT_NEAR(off, 0.5, 1e-6);
    EXPECT_GT(pair.image, 2);
    placements.insert(pair.placement);
  }
  EXPECT_EQ(placements.size(), 1U);
  options.faults = {.focus = 0.001};
  const auto refocused = made(options);
  EXPECT_GT(largest_shift(*refocused, *steady), 0.2);
  const auto& last = refocused->pairs().back();
  EXPECT_GT(last.left_blur_px + last.right_blur_px, 0.5);
}

TEST(Series, ShowsABlurredImage) {
  SeriesOptions options = {.image_scale = 0.5, .noise = false, .placements = {1}, .angles = 1};
  const StereoImages sharp = made(options)->shoot(0);
  options.faults.blurred = 1;
  const StereoImages blurred = made(options)->shoot(0);
  const auto contrast = [](const cv::Mat& image) {
    cv::Mat red, slope;
    cv::resize(image, red, {}, 0.5, 0.5, cv::INTER_NEAREST);
    cv::Sobel(red, slope, CV_32F, 2, 0);
    return cv::norm(slope);
  };
  const double left = contrast(blurred.left) / contrast(sharp.left);
  const double right = contrast(blurred.right) / contrast(sharp.right);
  EXPECT_LT(std::min(left, right), 0.7);
  EXPECT_EQ(std::max(left, right), 1.0);
}

TEST(Series, OfAHandHeldBoardNeedsNoTable) {
  const auto series = made({.rig = RigVariation{}, .hand_held = 12});
  ASSERT_EQ(series->pairs().size(), 12U);
  EXPECT_EQ(series->pairs()[4].name, "hand005");
  int inside = 0;
  for (const auto& pair : series->pairs()) {
    for (int id = 0; id < 88; ++id) {
      const Vector2d at = series->corner_pixel(pair, true, id);
      inside += at.x() > 0.0 && at.y() > 0.0 && at.x() < 1279.0 && at.y() < 959.0 ? 1 : 0;
    }
    EXPECT_LT((pair.rig.left.eye_from_turntable.linear() * pair.table_from_board.linear().col(2)).z(), 1.0);
  }
  EXPECT_GT(inside, 12 * 88 * 3 / 4);
}

TEST(Series, RefusesWhatItCannotTake) {
  EXPECT_EQ(CalibrationSeries::create({.image_scale = 4.0}).error().code, ErrorCode::out_of_range);
  EXPECT_EQ(CalibrationSeries::create({.placements = {8}}).error().code, ErrorCode::out_of_range);
  EXPECT_EQ(CalibrationSeries::create({.angles = 0}).error().code, ErrorCode::out_of_range);
  EXPECT_EQ(CalibrationSeries::create({.hand_held = -1}).error().code, ErrorCode::out_of_range);
}

}  // namespace
}  // namespace scanrig::sim
