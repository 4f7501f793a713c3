#include "daemon/api/admission.h"

#include <gmock/gmock.h>

#include <vector>

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;
using Door = Admission::Door;

class Seats : public testing::Test {
 protected:
  void open(const ApiLimits& limits) { admission = std::make_shared<Admission>(limits); }
  /// Name of the connection that has to leave.
  Admission::OnEvicted as(const std::string& connection) {
    return [this, connection] { evicted.push_back(connection); };
  }
  std::shared_ptr<Admission> admission;
  std::vector<std::string> evicted;
};

TEST_F(Seats, ThereIsAlwaysAWaitingPlaceAndTheOldestLosesIts) {
  open({.waiting = 2});
  const auto first = admission->wait(Door::tcp, "a", as("first"));
  const auto second = admission->wait(Door::tcp, "b", as("second"));
  const auto third = admission->wait(Door::tcp, "c", as("third"));
  EXPECT_TRUE(first && second && third);
  EXPECT_THAT(evicted, ElementsAre("first"));
  EXPECT_EQ(admission->connections(), 2u);
}

TEST_F(Seats, OfThoseThatWaitThePeerWithTheMostLosesItsOldest) {
  open({.waiting = 3});
  const auto slow = admission->wait(Door::tcp, "operator", as("operator"));
  std::vector<Admission::SeatPtr> flood;
  for (int i = 0; i < 5; ++i) flood.push_back(admission->wait(Door::tcp, "flood", as("flood " + std::to_string(i))));
  EXPECT_THAT(evicted, ElementsAre("flood 0", "flood 1", "flood 2"));
}

TEST_F(Seats, AnEvictedConnectionThatLeavesFreesNothing) {
  open({.waiting = 1});
  auto first = admission->wait(Door::tcp, "a", as("first"));
  const auto second = admission->wait(Door::tcp, "a", as("second"));
  first.reset();
  EXPECT_EQ(admission->connections(), 1u);
  const auto third = admission->wait(Door::tcp, "a", as("third"));
  EXPECT_THAT(evicted, ElementsAre("first", "second"));
}

TEST_F(Seats, APeerAndAllTogetherHaveSoMany) {
  open({.connections = 3, .connections_a_peer = 2});
  auto first = admission->enter(Door::tcp, "a", as("first"));
  const auto second = admission->enter(Door::tcp, "a", as("second"));
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(admission->enter(Door::tcp, "a", as("third")));
  const auto other = admission->enter(Door::tcp, "b", as("other"));
  EXPECT_TRUE(other);
  first.reset();
  EXPECT_TRUE(admission->enter(Door::tcp, "a", as("fourth")));
  EXPECT_THAT(evicted, IsEmpty());
}

TEST_F(Seats, WhereAllAreTakenThePeersShareThem) {
  open({.connections = 4, .connections_a_peer = 4});
  std::vector<Admission::SeatPtr> seats;
  for (const char* name : {"1", "2", "3", "4"}) seats.push_back(admission->enter(Door::tcp, "a", as(name)));
  EXPECT_FALSE(admission->enter(Door::tcp, "a", as("5"))) << "its own seats are not taken from a peer";
  seats.push_back(admission->enter(Door::tcp, "b", as("6")));
  seats.push_back(admission->enter(Door::tcp, "b", as("7")));
  EXPECT_TRUE(seats[4] && seats[5]);
  EXPECT_THAT(evicted, ElementsAre("1", "2"));
  EXPECT_FALSE(admission->enter(Door::tcp, "b", as("8"))) << "both have their share";
  EXPECT_EQ(admission->connections(), 4u);
}

TEST_F(Seats, LocalConnectionsHaveTheirOwn) {
  open({.waiting = 1, .connections = 1, .local_connections = 1});
  const auto far_wait = admission->wait(Door::tcp, "a", as("far waits"));
  const auto far = admission->enter(Door::tcp, "a", as("far"));
  EXPECT_TRUE(admission->wait(Door::local, "user 1", as("near waits")));
  EXPECT_TRUE(admission->enter(Door::local, "user 1", as("near")));
  EXPECT_THAT(evicted, IsEmpty());
}

TEST_F(Seats, AReservedOneIsAlwaysThere) {
  open({.connections = 0, .reserved = 1});
  EXPECT_FALSE(admission->enter(Door::tcp, "a", as("no seat")));
  const auto first = admission->enter_reserved("a", as("first"));
  const auto second = admission->enter_reserved("a", as("second"));
  EXPECT_TRUE(first && second);
  EXPECT_THAT(evicted, ElementsAre("first"));
}

TEST(Admission, RequestsAreSoManyAtOnceAndComeBackWithTime) {
  Admission admission({.requests_a_second = 10, .requests_at_once = 3});
  const auto now = Admission::Clock::now();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(admission.may_request("a", now)) << i;
  EXPECT_FALSE(admission.may_request("a", now));
  EXPECT_TRUE(admission.may_request("b", now)) << "another peer is not concerned";
  EXPECT_TRUE(admission.may_request("a", now + milliseconds(150)));
  EXPECT_FALSE(admission.may_request("a", now + milliseconds(150)));
}

TEST(Admission, GuessingTokensIsDear) {
  Admission admission({.requests_a_second = 10, .requests_at_once = 100, .price_of_a_bad_token = 60});
  const auto now = Admission::Clock::now();
  admission.charge_bad_token("a", now);
  EXPECT_TRUE(admission.may_request("a", now));
  admission.charge_bad_token("a", now);
  EXPECT_FALSE(admission.may_request("a", now));
  EXPECT_FALSE(admission.may_request("a", now + milliseconds(1000)));
}

TEST(Admission, TheNumberOfAddressesDoesNotBuyGuesses) {
  Admission admission({.requests_a_second = 10, .requests_at_once = 1, .price_of_a_bad_token = 100});
  const auto now = Admission::Clock::now();
  admission.charge_bad_token("a", now);
  for (int i = 0; i < 3000; ++i) admission.may_request(std::to_string(i), now + milliseconds(500));
  EXPECT_FALSE(admission.may_request("a", now + milliseconds(500))) << "a debt is not forgotten before it is paid";
}

}  // namespace
}  // namespace scanrig
