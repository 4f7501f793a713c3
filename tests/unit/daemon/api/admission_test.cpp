#include "daemon/api/admission.h"

#include <gtest/gtest.h>

#include <vector>

namespace scanrig {
namespace {

using std::chrono::milliseconds;

TEST(Admission, APeerAndAllTogetherHaveSoManyPlaces) {
  const auto admission = std::make_shared<Admission>(ApiLimits{.connections = 3, .connections_a_peer = 2});
  auto first = admission->enter("a");
  const auto second = admission->enter("a");
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(admission->enter("a"));
  const auto other = admission->enter("b");
  EXPECT_TRUE(other);
  EXPECT_FALSE(admission->enter("c")) << "all places are taken";
  EXPECT_EQ(admission->connections(), 3u);
  first.reset();
  EXPECT_TRUE(admission->enter("a"));
}

TEST(Admission, OnlySoManyAreTurnedAwayWithAWord) {
  const auto admission = std::make_shared<Admission>(ApiLimits{.connections = 0});
  std::vector<std::unique_ptr<Admission::Seat>> leaving;
  while (auto seat = admission->enter_to_be_turned_away()) leaving.push_back(std::move(seat));
  EXPECT_EQ(leaving.size(), 32u);
  leaving.pop_back();
  EXPECT_TRUE(admission->enter_to_be_turned_away());
}

TEST(Admission, RequestsAreSoManyAtOnceAndComeBackWithTime) {
  const auto admission = std::make_shared<Admission>(ApiLimits{.requests_a_second = 10, .requests_at_once = 3});
  auto seat = admission->enter("a");
  const auto now = Admission::Clock::now();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(seat->may_ask(now)) << i;
  EXPECT_FALSE(seat->may_ask(now));
  EXPECT_TRUE(admission->enter("b")->may_ask(now)) << "another peer is not concerned";
  EXPECT_TRUE(seat->may_ask(now + milliseconds(150)));
  EXPECT_FALSE(seat->may_ask(now + milliseconds(150)));
}

TEST(Admission, HangingUpBuysNoRequests) {
  const auto admission = std::make_shared<Admission>(ApiLimits{.requests_a_second = 1, .requests_at_once = 1});
  const auto now = Admission::Clock::now();
  EXPECT_TRUE(admission->enter("a")->may_ask(now));
  EXPECT_FALSE(admission->enter("a")->may_ask(now));
}

TEST(Admission, GuessingTokensIsDear) {
  const auto admission = std::make_shared<Admission>(
      ApiLimits{.requests_a_second = 10, .requests_at_once = 100, .price_of_a_bad_token = 60});
  auto seat = admission->enter("a");
  const auto now = Admission::Clock::now();
  seat->showed_bad_token(now);
  EXPECT_TRUE(seat->may_ask(now));
  seat->showed_bad_token(now);
  EXPECT_FALSE(seat->may_ask(now));
  EXPECT_FALSE(seat->may_ask(now + milliseconds(1000)));
}

}  // namespace
}  // namespace scanrig
