#include "pipeline/pose/view_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace scanrig {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

const PoseGraphOptions kGraph{.same_deg = 5.0, .same_mm = 5.0, .arm_mm = 40.0};

/// Views along a line: view i of the object lies 10 i mm along x. Neighbours share surface, others say nothing.
Transform place_of(std::size_t view) {
  Transform model_from_view = Transform::Identity();
  model_from_view.translation().x() = 10.0 * static_cast<double>(view);
  return model_from_view;
}

PairMotion motion_between(std::size_t a, std::size_t b, double confirmed) {
  return {a, b, place_of(a).inverse() * place_of(b), confirmed, true, false};
}

PairMotion shifted(PairMotion motion, double mm) {
  motion.pose1_from_pose2.translation().y() += mm;
  return motion;
}

/// What views within `reach` of each other see: only the true motion fits.
PairJudge judge_within(std::size_t reach) {
  return [reach](std::size_t a, std::size_t b, const Transform& a_from_b) {
    EXPECT_LT(a, b);
    if (b - a > reach) return PairVerdict{PairVerdict::Kind::apart, 0.0, 0.0};
    const bool is_true = alike(a_from_b, place_of(a).inverse() * place_of(b), kGraph);
    return is_true ? PairVerdict{PairVerdict::Kind::agrees, 0.5, 0.0}
                   : PairVerdict{PairVerdict::Kind::contradicts, 0.0, 0.5};
  };
}

void expect_set_in_place(const ViewSet& set) {
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    const Transform expected = place_of(set.views.front()).inverse() * place_of(set.views[i]);
    EXPECT_TRUE(set.model_from_view[i].isApprox(expected, 1e-12)) << "view " << set.views[i];
  }
}

TEST(JoinViews, AChainOfNeighboursIsOneSet) {
  const std::vector<PairMotion> motions{motion_between(2, 3, 0.6), motion_between(0, 1, 0.5),
                                        motion_between(1, 2, 0.4)};
  const auto sets = join_views(4, motions, judge_within(1), kGraph);
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_THAT(sets[0].views, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(sets[0].tree, SizeIs(3));
  expect_set_in_place(sets[0]);
}

TEST(JoinViews, AMotionThatAnyTwoViewsContradictIsLeftOut) {
  const std::vector<PairMotion> motions{motion_between(0, 1, 0.9), motion_between(2, 3, 0.8),
                                        shifted(motion_between(1, 3, 0.7), 30.0), motion_between(1, 2, 0.3)};
  const auto sets = join_views(4, motions, judge_within(1), kGraph);  // 1 and 3 see nothing of each other, 1 and 2 do
  ASSERT_THAT(sets, SizeIs(1));
  ASSERT_THAT(sets[0].views, SizeIs(4));
  expect_set_in_place(sets[0]);
}

TEST(JoinViews, TwoMotionsThatFitAlikeJoinNothing) {
  const std::vector<PairMotion> motions{motion_between(0, 1, 0.9), motion_between(1, 4, 0.5),
                                        shifted(motion_between(1, 4, 0.45), 30.0)};
  const auto sets = join_views(5, motions, judge_within(1), kGraph);
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_THAT(sets[0].views, ElementsAre(0, 1));
}

TEST(JoinViews, ARivalMayBeContradictedByAViewThatJoinsLater) {
  const std::vector<PairMotion> motions{motion_between(1, 3, 0.5), shifted(motion_between(1, 3, 0.48), 30.0),
                                        motion_between(1, 2, 0.3)};
  const auto sets = join_views(4, motions, judge_within(1), kGraph);
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_THAT(sets[0].views, ElementsAre(1, 2, 3));
  expect_set_in_place(sets[0]);
}

TEST(JoinViews, AMotionMayBeginInTheLaterSet) {
  const std::vector<PairMotion> motions{motion_between(0, 3, 0.9), motion_between(1, 3, 0.8)};
  const auto sets = join_views(4, motions, judge_within(3), kGraph);
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_THAT(sets[0].views, ElementsAre(0, 1, 3));
  expect_set_in_place(sets[0]);
}

TEST(JoinViews, WhatAllViewsConfirmDecidesBetweenRivals) {
  // 4 sees nothing of 2 and 3 but where they lie in truth; its own motions to 0 are as good as each other.
  const PairJudge judge = [](std::size_t a, std::size_t b, const Transform& a_from_b) {
    using Verdict = PairVerdict;
    const bool is_true = alike(a_from_b, place_of(a).inverse() * place_of(b), kGraph);
    return is_true ? Verdict{Verdict::Kind::agrees, 0.5, 0.0} : Verdict{Verdict::Kind::apart, 0.0, 0.0};
  };
  const std::vector<PairMotion> motions{motion_between(0, 2, 0.9), motion_between(0, 3, 0.9),
                                        shifted(motion_between(0, 4, 0.5), 30.0), motion_between(0, 4, 0.5)};
  const auto sets = join_views(5, motions, judge, kGraph);
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_THAT(sets[0].views, ElementsAre(0, 2, 3, 4));
  expect_set_in_place(sets[0]);
}

TEST(JoinViews, TheLargestSetComesFirst) {
  const std::vector<PairMotion> motions{motion_between(3, 4, 0.9), motion_between(0, 1, 0.5),
                                        motion_between(1, 2, 0.4)};
  const auto sets = join_views(6, motions, judge_within(1), kGraph);
  ASSERT_THAT(sets, SizeIs(2));
  EXPECT_THAT(sets[0].views, ElementsAre(0, 1, 2));
  EXPECT_THAT(sets[1].views, ElementsAre(3, 4));
}

TEST(JoinViews, NothingIsJoinedWithoutMotions) { EXPECT_THAT(join_views(3, {}, judge_within(1), kGraph), SizeIs(0)); }

}  // namespace
}  // namespace scanrig
