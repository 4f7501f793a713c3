#include "pipeline/volume/class_table.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace scanrig {
namespace {

using enum VoxelClass;
constexpr float kThreshold = 0.5F;
constexpr float kBackground = std::numeric_limits<float>::infinity();

PoseDistance classified(std::vector<float> distances) {
  std::vector<ViewDistance> views;
  for (const float d : distances) views.push_back({d, 1.0F, 0.01F});
  return classify(views, kThreshold);
}

PoseDistance pose(VoxelClass voxel_class, float distance, float weight = 1.0F, float positive_share = 0.5F,
                  int surface_views = 2) {
  return {voxel_class, distance, weight, positive_share, surface_views};
}

/// Combines both ways round; the table is symmetric.
CombinedDistance combined(const PoseDistance& a, const PoseDistance& b) {
  const CombinedDistance result = combine(a, b, kThreshold);
  const CombinedDistance mirrored = combine(b, a, kThreshold);
  EXPECT_FLOAT_EQ(result.distance, mirrored.distance);
  EXPECT_EQ(result.conflict, mirrored.conflict);
  return result;
}

TEST(VoxelClasses, TwoViewsNearTheSurfaceMakeOverlapWithTheirWeightedMean) {
  const std::vector<ViewDistance> views = {{0.1F, 3.0F, 0.01F}, {0.3F, 1.0F, 0.01F}, {-5.0F, 9.0F, 0.01F}};
  const PoseDistance p = classify(views, kThreshold);
  EXPECT_EQ(p.voxel_class, overlap);
  EXPECT_FLOAT_EQ(p.distance, 0.15F);
  EXPECT_EQ(p.surface_views, 2);
}

TEST(VoxelClasses, OutsideOfEveryViewTakesTheSmallestDistance) {
  const PoseDistance p = classified({2.0F, kBackground, 0.7F});
  EXPECT_EQ(p.voxel_class, outside);
  EXPECT_FLOAT_EQ(p.distance, 0.7F);
  EXPECT_FLOAT_EQ(p.positive_share, 1.0F);
}

TEST(VoxelClasses, InsideOfEveryViewTakesTheDistanceNearestToTheSurface) {
  const PoseDistance p = classified({-2.0F, -0.7F, -9.0F});
  EXPECT_EQ(p.voxel_class, inside);
  EXPECT_FLOAT_EQ(p.distance, -0.7F);
}

TEST(VoxelClasses, NonoverlapTakesTheSmallestDistanceOfTheViewsThatAreNotOccluded) {
  const PoseDistance p = classified({-0.6F, 3.0F, 0.9F});
  EXPECT_EQ(p.voxel_class, nonoverlap);
  EXPECT_FLOAT_EQ(p.distance, 0.9F);
}

TEST(VoxelClasses, OneViewThatSeesTheBackgroundBeatsOccludedOnes) {
  const PoseDistance p = classified({-6.0F, kBackground});
  EXPECT_EQ(p.voxel_class, nonoverlap);
  EXPECT_EQ(p.distance, kBackground);
}

TEST(VoxelClasses, NoViewAtAllIsUnseen) { EXPECT_EQ(classified({}).voxel_class, unseen); }

TEST(VoxelClasses, NoisyViewHasAWiderThreshold) {
  const std::vector<ViewDistance> views = {{0.8F, 1.0F, 0.25F}, {-0.8F, 1.0F, 0.25F}};
  EXPECT_EQ(classify(views, kThreshold).voxel_class, overlap);
}

TEST(ClassTable, OverlapWithOverlapIsTheWeightedMean) {
  EXPECT_FLOAT_EQ(combined(pose(overlap, 0.4F, 1.0F), pose(overlap, 0.0F, 3.0F)).distance, 0.1F);
}

TEST(ClassTable, OverlapWithNonoverlapAveragesOnlyWhatAgrees) {
  EXPECT_FLOAT_EQ(combined(pose(overlap, 0.2F), pose(nonoverlap, 0.4F)).distance, 0.3F);
  EXPECT_FLOAT_EQ(combined(pose(overlap, 0.2F), pose(nonoverlap, 2.0F)).distance, 0.2F);
}

TEST(ClassTable, OverlapWithInsideIsTheOverlap) {
  EXPECT_FLOAT_EQ(combined(pose(overlap, 0.2F), pose(inside, -3.0F)).distance, 0.2F);
}

TEST(ClassTable, OverlapInFrontOfItsSurfaceWithOutsideIsNoConflict) {
  const auto c = combined(pose(overlap, 0.2F), pose(outside, 4.0F));
  EXPECT_FLOAT_EQ(c.distance, 0.2F);
  EXPECT_FALSE(c.conflict);
  EXPECT_FLOAT_EQ(combined(pose(overlap, 0.9F), pose(outside, 4.0F)).distance, kThreshold);
}

TEST(ClassTable, OverlapBehindItsSurfaceWithOutsideIsAConflict) {
  const auto c = combined(pose(overlap, -0.3F, 1.0F), pose(outside, 4.0F, 1.0F));
  EXPECT_FLOAT_EQ(c.distance, 0.1F);  // the mean of -0.3 and 4, which counts as 0.5
  EXPECT_TRUE(c.conflict);
}

TEST(ClassTable, NonoverlapTwiceTakesThePoseWithMoreViewsInFront) {
  EXPECT_FLOAT_EQ(combined(pose(nonoverlap, 0.4F, 1, 0.75F), pose(nonoverlap, -0.1F, 1, 0.25F)).distance, 0.4F);
}

TEST(ClassTable, NonoverlapTieGoesToTheSmallerThenToThePositive) {
  EXPECT_FLOAT_EQ(combined(pose(nonoverlap, 0.4F), pose(nonoverlap, -0.1F)).distance, -0.1F);
  EXPECT_FLOAT_EQ(combined(pose(nonoverlap, 0.2F), pose(nonoverlap, -0.2F)).distance, 0.2F);
}

TEST(ClassTable, NonoverlapWithInsideIsTheNonoverlap) {
  EXPECT_FLOAT_EQ(combined(pose(nonoverlap, 0.4F), pose(inside, -3.0F)).distance, 0.4F);
}

TEST(ClassTable, NonoverlapWithOutsideIsOutsideAndAConflictForASingleViewSurface) {
  const auto quiet = combined(pose(nonoverlap, -0.2F, 1, 0.5F, 0), pose(outside, 2.0F));
  EXPECT_FLOAT_EQ(quiet.distance, 2.0F);
  EXPECT_FALSE(quiet.conflict);
  EXPECT_TRUE(combined(pose(nonoverlap, -0.2F, 1, 0.5F, 1), pose(outside, 2.0F)).conflict);
}

TEST(ClassTable, InsideTwiceTakesTheNearerSurface) {
  EXPECT_FLOAT_EQ(combined(pose(inside, -0.6F), pose(inside, -3.0F)).distance, -0.6F);
}

TEST(ClassTable, InsideOfOneAndOutsideOfTheOtherIsOutside) {
  EXPECT_FLOAT_EQ(combined(pose(inside, -3.0F), pose(outside, 2.0F)).distance, 2.0F);
}

TEST(ClassTable, OutsideTwiceTakesTheNearerSurface) {
  EXPECT_FLOAT_EQ(combined(pose(outside, 3.0F), pose(outside, 2.0F)).distance, 2.0F);
}

TEST(ClassTable, UnseenLeavesTheDecisionToTheOtherPose) {
  for (const auto other : {overlap, nonoverlap, inside, outside}) {
    EXPECT_FLOAT_EQ(combined(pose(unseen, 0.0F), pose(other, 0.7F)).distance, 0.7F);
  }
}

}  // namespace
}  // namespace scanrig
