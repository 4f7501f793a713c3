#include "pipeline/pose/pose_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace scanrig {
namespace {

/// 1000 samples, so many of them measured where they should be and so many in free space.
Hypothesis checked(std::size_t confirmed, std::size_t contradicted) {
  Hypothesis h;
  h.sample_checks.resize(1000);
  for (std::size_t i = 0; i < confirmed; ++i) h.sample_checks[i] = {SampleCheck::Kind::surface, 0.001F, 0.01F};
  for (std::size_t i = 0; i < contradicted; ++i) h.sample_checks[999 - i].kind = SampleCheck::Kind::free_space;
  return h;
}

std::size_t confirmed_by_the_best(std::vector<Hypothesis> field) {
  judge(field, {});
  return static_cast<std::size_t>(std::lround(1000 * field[0].candidate.agreement.confirmed));
}

TEST(PoseSearch, OneThatIsNotContradictedComesBeforeOneThatConfirmsMore) {
  EXPECT_EQ(confirmed_by_the_best({checked(600, 25), checked(400, 1)}), 400U);
}

TEST(PoseSearch, OneThatConfirmsFarLessDoesNot) {
  EXPECT_EQ(confirmed_by_the_best({checked(600, 25), checked(290, 1)}), 600U);
}

/// Both are what a right one may be: the one that confirms more comes first.
TEST(PoseSearch, OfTwoThatAreHardlyContradictedTheOneThatConfirmsMoreComesFirst) {
  EXPECT_EQ(confirmed_by_the_best({checked(400, 1), checked(600, 6)}), 600U);
}

}  // namespace
}  // namespace scanrig
