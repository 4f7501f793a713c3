#include "pipeline/registration/moved_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig {
namespace {

using testing::RigModel;

constexpr int kViews = 12;

/// What the view sees where the work piece stands elsewhere than believed.
void see_moved(View& view, const Transform& moved, const RigModel& rig, unsigned seed) {
  const Transform believed = view.range.camera_from_pose;
  view.range = testing::see(testing::workpiece(), believed * moved, rig, seed);
  view.range.camera_from_pose = believed;
}

/// The work piece, which stands elsewhere on the table from `first` view to the one before `end`: `moved(view)`.
template <class Moved>
std::vector<View> views_with_each(const Moved& moved, int first, int end) {
  RigModel rig;
  rig.noise_mm = 0.01;
  auto views = testing::turn_around(testing::workpiece(), kViews, rig);
  for (int v = first; v < end; ++v) {
    see_moved(views[static_cast<std::size_t>(v)], moved(v), rig, 100U + static_cast<unsigned>(v));
  }
  return views;
}

std::vector<View> views_with(const Transform& moved, int first, int end) {
  return views_with_each([&](int) { return moved; }, first, end);
}

/// The motions of views that stand elsewhere, and how well they stand once these are undone.
struct Undone {
  std::vector<ObjectMotion> motions;
  double median_before = 0.0, median_after = 0.0;
};

Undone undo(std::vector<View> views, std::size_t watched) {
  Undone result{.motions = find_object_motions(views, {})};
  auto left = views;
  const auto before = register_views(left, {}, {});
  for (const ObjectMotion& motion : result.motions) undo_motion(views, motion);
  const auto after = register_views(views, {}, {});
  EXPECT_TRUE(before && after);
  if (!before || !after) return result;
  result.median_before = before->views[watched].median_before_mm;
  result.median_after = after->views[watched].median_after_mm;
  return result;
}

TEST(MovedViews, NothingIsNamedWhereNothingMoved) {
  const auto views = views_with(Transform::Identity(), 0, 0);
  EXPECT_TRUE(find_object_motions(views, {}).empty());
}

TEST(MovedViews, ACreepOfAnEighthOfAPixelInOneViewIsNamedAndUndone) {
  const Undone undone = undo(views_with(small_motion({0, 0, 0}, {0.01, 0, 0.05}), 5, 6), 5);
  ASSERT_EQ(undone.motions.size(), 1U);
  EXPECT_EQ(undone.motions[0].view, 5U);
  EXPECT_EQ(undone.motions[0].views, 1U);
  EXPECT_NEAR(undone.motions[0].mm, 0.05, 0.015);
  EXPECT_LT(undone.median_after, 0.4 * undone.median_before);
}

TEST(MovedViews, ARockInOneViewIsNamedAndUndone) {
  const Undone undone = undo(views_with(small_motion({to_radians(0.05), 0, 0}, {0, 0, 0}), 7, 8), 7);
  ASSERT_EQ(undone.motions.size(), 1U);
  EXPECT_EQ(undone.motions[0].view, 7U);
  EXPECT_LT(undone.median_after, 0.8 * undone.median_before);
}

TEST(MovedViews, AnObjectThatStaysWhereItSlippedToIsNamedOnce) {
  const Undone undone = undo(views_with(small_motion({0, 0, 0}, {0.08, 0, 0.06}), 7, kViews), 7);
  ASSERT_EQ(undone.motions.size(), 1U);
  EXPECT_EQ(undone.motions[0].view, 7U);
  EXPECT_EQ(undone.motions[0].views, 5U);
  EXPECT_NEAR(undone.motions[0].mm, 0.1, 0.02);
}

TEST(MovedViews, StepsBetweenWhichViewsDriftAreNoMotionOfTheObject) {
  // Neighbours within the drift differ by 0.02 mm, its ends from the others by 0.06.
  const auto drifted = [](int view) {
    const double turn = 0.5 * std::numbers::pi * (view - 3) / 5.0;
    return small_motion({0, 0, 0}, {0.06 * std::cos(turn), 0, 0.06 * std::sin(turn)});
  };
  EXPECT_TRUE(find_object_motions(views_with_each(drifted, 3, 9), {}).empty());
}

TEST(MovedViews, TheFirstViewMayBeTheOneThatStandsElsewhere) {
  const Undone undone = undo(views_with(small_motion({0, 0, 0}, {0, 0, 0.05}), 0, 1), 0);
  ASSERT_EQ(undone.motions.size(), 1U);
  EXPECT_EQ(undone.motions[0].view, 0U);
  EXPECT_EQ(undone.motions[0].views, 1U);
}

TEST(MovedViews, AViewThatNoRigidMotionMendsDoesNotFit) {
  auto views = views_with(Transform::Identity(), 0, 0);
  for (auto& depth : views[4].range.depth) depth *= 1.0F + 0.0004F;  // 0.25 mm, and what registration cannot undo
  cv::Mat1f& bent = views[4].range.depth;
  for (int v = 0; v < bent.rows; ++v) {
    for (int u = 0; u < bent.cols; ++u) bent(v, u) += static_cast<float>(0.15 * std::sin(0.05 * u));
  }
  const auto report = register_views(views, {}, {});
  ASSERT_TRUE(report);
  const auto misfits = views_that_do_not_fit(views, *report);
  ASSERT_EQ(misfits.size(), 1U);
  EXPECT_EQ(misfits[0], 4U);
}

TEST(MovedViews, FewViewsHaveNoMajority) {
  auto views = views_with(small_motion({0, 0, 0}, {0.05, 0, 0}), 1, 2);
  views.resize(4);
  const auto report = register_views(views, {}, {});
  ASSERT_TRUE(report);
  EXPECT_TRUE(find_object_motions(views, {}).empty());
  EXPECT_TRUE(views_that_do_not_fit(views, *report).empty());
}

}  // namespace
}  // namespace scanrig
