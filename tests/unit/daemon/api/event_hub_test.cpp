#include "daemon/api/event_hub.h"

#include <gmock/gmock.h>

namespace scanrig {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pointee;
using testing::StartsWith;

class Hub : public testing::Test {
 protected:
  void show(const std::string& sentence, JobTable jobs = {}) {
    hub.see(
        std::make_shared<Snapshot>(Snapshot{.revision = ++revision, .sentence = sentence, .jobs = std::move(jobs)}));
  }
  static JobTable job(double fraction) {
    return {{"a", std::make_shared<JobInfo>(JobInfo{.id = "a", .stages = {{"volume", fraction}}})}};
  }
  EventHub hub{"life", 4};
  std::uint64_t revision = 0;
};

TEST_F(Hub, AClientThatBeginsGetsThePresentStatus) {
  show("one");
  show("two");
  EXPECT_THAT(hub.join("").texts, ElementsAre(Pointee(AllOf(StartsWith("id: life-2\nevent: status\ndata: {"),
                                                            HasSubstr("two"), testing::EndsWith("}\n\n")))));
}

TEST_F(Hub, WhatNobodySeesIsNoEvent) {
  show("one");
  const auto last = hub.join("").last;
  show("one");
  EXPECT_EQ(hub.after(last).last, last) << "only the revision is another";
  EXPECT_TRUE(hub.after(last).texts.empty());
}

TEST_F(Hub, JobsAreToldWhenTheyChangeAndWhenTheyAreGone) {
  show("one", job(0.1));
  const auto last = hub.join("").last;
  show("one", job(0.6));
  show("one");
  EXPECT_THAT(hub.after(last).texts,
              ElementsAre(Pointee(AllOf(HasSubstr("event: job\n"), HasSubstr("0.6"))),
                          Pointee(AllOf(HasSubstr("event: job_deleted\n"), HasSubstr("\"a\"")))));
}

TEST_F(Hub, AClientThatComesBackGetsWhatItMissed) {
  for (const auto* sentence : {"one", "two", "three"}) show(sentence);
  EXPECT_THAT(hub.join("life-1").texts, ElementsAre(Pointee(HasSubstr("two")), Pointee(HasSubstr("three"))));
  EXPECT_TRUE(hub.join("life-3").texts.empty());
}

TEST_F(Hub, WhoMissedMoreThanIsKeptIsToldSo) {
  for (const auto* sentence : {"one", "two", "three", "four", "five", "six"}) show(sentence);
  EXPECT_THAT(hub.join("life-2").texts.size(), 4u) << "all that is kept";
  for (const auto* id : {"life-1", "life-99", "other-6", "life-", "life", "life-6x", "6"}) {
    EXPECT_THAT(hub.join(id).texts, ElementsAre(Pointee(HasSubstr("event: lost\n")), Pointee(HasSubstr("six")))) << id;
  }
  EXPECT_THAT(hub.after(1).texts, ElementsAre(Pointee(HasSubstr("event: lost\n")), Pointee(HasSubstr("six"))));
}

TEST_F(Hub, SubscribersAreWokenOnlyByEventsAndOnlyWhileTheyWish) {
  int woken = 0;
  const auto number = hub.subscribe([&] { ++woken; });
  EXPECT_EQ(hub.subscribers(), 1u);
  show("one");
  show("one");
  EXPECT_EQ(woken, 1);
  hub.unsubscribe(number);
  show("two");
  EXPECT_EQ(woken, 1);
}

}  // namespace
}  // namespace scanrig
