#include "pipeline/pose/pose_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/units.h"

namespace scanrig {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Kind = PairVerdict::Kind;

Transform turned(double degrees, const Eigen::Vector3d& axis, double shift) {
  Transform t = Transform::Identity();
  t.linear() = Eigen::AngleAxisd(to_radians(degrees), axis.normalized()).toRotationMatrix();
  t.translation() = Eigen::Vector3d(shift, 0.5 * shift, -shift);
  return t;
}

/// Where the poses really lie, and what their surfaces say: they agree with the truth and contradict all else.
struct TrueScan {
  std::vector<Transform> model_from_pose;
  std::vector<std::pair<std::size_t, std::size_t>> apart;     ///< pairs that share no surface
  std::vector<std::size_t> foreign;                           ///< poses of another object
  std::vector<std::pair<std::size_t, std::size_t>> gullible;  ///< pairs that agree with anything
  mutable int asked = 0;
  PoseGraphOptions options{};

  [[nodiscard]] Transform motion(std::size_t a, std::size_t b) const {
    return model_from_pose[a].inverse() * model_from_pose[b];
  }
  [[nodiscard]] PairMotion right(std::size_t a, std::size_t b, double confirmed = 0.4) const {
    return {a, b, motion(a, b), confirmed};
  }
  [[nodiscard]] PairMotion wrong(std::size_t a, std::size_t b, double confirmed = 0.4) const {
    return {a, b, turned(120, {1, 2, 3}, 2) * motion(a, b), confirmed};
  }
  [[nodiscard]] PairJudge judge() const {
    return [this](std::size_t a, std::size_t b, const Transform& m) -> PairVerdict {
      ++asked;
      EXPECT_LT(a, b);
      if (std::ranges::find(apart, std::pair(a, b)) != apart.end()) return {Kind::apart, 0.0, 0.0};
      if (std::ranges::find(gullible, std::pair(a, b)) != gullible.end()) return {Kind::agrees, 0.3, 0.0};
      const bool is_foreign =
          std::ranges::find(foreign, a) != foreign.end() || std::ranges::find(foreign, b) != foreign.end();
      if (is_foreign || !alike(m, motion(a, b), options)) return {Kind::contradicts, 0.1, 0.3};
      return {Kind::agrees, 0.4, 0.01};
    };
  }
  [[nodiscard]] Result<PoseSet> best(const std::vector<PairMotion>& motions) const {
    return best_pose_set(model_from_pose.size(), motions, judge(), options);
  }
  void expect_kept(const Result<PoseSet>& set, const std::vector<std::size_t>& kept) const {
    ASSERT_TRUE(set) << set.error().message;
    for (std::size_t pose = 0; pose < model_from_pose.size(); ++pose) {
      const bool is_kept = std::ranges::find(kept, pose) != kept.end();
      EXPECT_EQ(set->model_from_pose[pose].has_value(), is_kept) << "pose " << pose;
      if (!is_kept || !set->model_from_pose[pose]) continue;
      EXPECT_TRUE(alike(set->motion(kept.front(), pose), motion(kept.front(), pose), options)) << "pose " << pose;
    }
    EXPECT_TRUE(set->model_from_pose[kept.front()]->isApprox(Transform::Identity()));
  }
};

TrueScan scan_of(std::size_t poses) {
  TrueScan scan;
  for (std::size_t i = 0; i < poses; ++i) {
    const double k = static_cast<double>(i);
    scan.model_from_pose.push_back(turned(75 * k, {1, 0.3 * k, 2 - k}, 3 * k));
  }
  return scan;
}

TEST(PoseGraph, PosesThatAllAgreeAreAllPlacedAndTheirPairsNotAskedAgain) {
  const TrueScan scan = scan_of(4);
  std::vector<PairMotion> motions;
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) motions.push_back(scan.right(a, b));
  }
  scan.expect_kept(scan.best(motions), {0, 1, 2, 3});
  EXPECT_EQ(scan.asked, 0);
}

TEST(PoseGraph, ASpanningChainIsEnough) {
  TrueScan scan = scan_of(4);
  scan.apart = {{0, 2}, {0, 3}, {1, 3}};
  scan.expect_kept(scan.best({scan.right(0, 1), scan.right(1, 2), scan.right(2, 3)}), {0, 1, 2, 3});
}

TEST(PoseGraph, AWrongPairIsOutvotedHoweverMuchItConfirms) {
  const TrueScan scan = scan_of(3);
  scan.expect_kept(scan.best({scan.wrong(0, 1, 0.9), scan.right(0, 2), scan.right(1, 2)}), {0, 1, 2});
  const TrueScan four = scan_of(4);
  scan.expect_kept(scan.best({scan.right(0, 1), scan.right(0, 2), scan.wrong(1, 2, 0.9)}), {0, 1, 2});
  four.expect_kept(four.best({four.wrong(0, 1, 0.9), four.right(0, 2), four.right(1, 2), four.right(2, 3)}),
                   {0, 1, 2, 3});
}

TEST(PoseGraph, APoseOfAnotherObjectIsLeftOutEvenTheFirst) {
  TrueScan scan = scan_of(4);
  scan.foreign = {2};
  const auto fits_once = scan.wrong(1, 2, 0.5);
  scan.expect_kept(scan.best({scan.right(0, 1), scan.right(0, 3), fits_once}), {0, 1, 3});
  scan.foreign = {0};
  scan.expect_kept(scan.best({scan.right(1, 2), scan.right(2, 3), scan.wrong(0, 1, 0.2)}), {1, 2, 3});
}

TEST(PoseGraph, AnotherPoseDecidesBetweenMotionsThatFitAPairAlike) {
  const TrueScan scan = scan_of(3);
  PairMotion a = scan.wrong(0, 1, 0.45), b = scan.right(0, 1, 0.4);
  a.is_certain = b.is_certain = false;
  scan.expect_kept(scan.best({a, b, scan.right(0, 2)}), {0, 1, 2});
}

TEST(PoseGraph, APoseWhosePlaceNothingDecidesIsLeftOutAndNamed) {
  TrueScan scan = scan_of(3);
  scan.apart = {{1, 2}};
  scan.gullible = {{0, 1}};
  PairMotion a = scan.wrong(0, 1, 0.4), b = scan.right(0, 1, 0.4);
  a.is_certain = b.is_certain = false;
  const auto set = scan.best({a, b, scan.right(0, 2)});
  scan.expect_kept(set, {0, 2});
  EXPECT_THAT(set->doubtful, ElementsAre(1U));
}

TEST(PoseGraph, SetsThatExcludeEachOtherAreAmbiguous) {
  TrueScan scan = scan_of(4);
  scan.foreign = {2, 3};
  const auto set = scan.best({scan.right(0, 1), scan.right(2, 3)});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::ambiguous);
  EXPECT_THAT(set.error().message, HasSubstr("poses 1 and 2 fit together"));
  EXPECT_THAT(set.error().message, HasSubstr("3 and 4"));
  const auto unequal = scan.best({scan.right(0, 1), scan.right(2, 3, 0.2)});
  scan.expect_kept(unequal, {0, 1});
}

TEST(PoseGraph, MotionsThatGiveTheSameSurfaceAreNoRivals) {
  TrueScan scan = scan_of(3);
  scan.gullible = {{0, 1}, {0, 2}, {1, 2}};  // a bottle: any turn fits
  PairMotion first = scan.right(0, 1), second = scan.wrong(0, 2), third = scan.right(1, 2);
  first.is_symmetric = second.is_symmetric = third.is_symmetric = true;
  const auto set = scan.best({first, second, third});
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->size(), 3U);
  EXPECT_TRUE(set->uses_symmetry);
}

TEST(PoseGraph, NoMotionIsNoOverlap) {
  const auto set = scan_of(3).best({});
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::no_overlap);
}

}  // namespace
}  // namespace scanrig
