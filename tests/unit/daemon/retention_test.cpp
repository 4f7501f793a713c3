#include "daemon/jobs/retention.h"

#include <gmock/gmock.h>

namespace scanrig {
namespace {

using std::chrono::days;
using testing::ElementsAre;
using testing::IsEmpty;

KeptJob job(const std::string& id, int age_days, std::uint64_t number, bool is_removable = true) {
  return {.id = id, .age = days(age_days), .number = number, .bytes = 10, .is_removable = is_removable};
}

TEST(Retention, KeepsEverythingUnlessLimited) {
  EXPECT_THAT(jobs_to_remove({job("a", 9000, 1), job("b", 1, 2)}, {}), IsEmpty());
}

TEST(Retention, RemovesWhatIsTooOldInOrderOfEnding) {
  EXPECT_THAT(jobs_to_remove({job("new", 1, 3), job("old", 40, 2), job("older", 50, 1)}, {.keep_for = days(30)}),
              ElementsAre("older", "old"));
  EXPECT_THAT(jobs_to_remove({job("just", 30, 1)}, {.keep_for = days(30)}), IsEmpty());
}

TEST(Retention, MakesRoomInOrderOfEnding) {
  const std::vector<KeptJob> jobs{job("a", 0, 9), job("b", 0, 8), job("c", 0, 7, false), job("d", 0, 6),
                                  job("e", 0, 5)};
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_bytes = 50}), IsEmpty());
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_bytes = 40}), ElementsAre("e"));
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_bytes = 15}), ElementsAre("e", "d", "b", "a"));
}

TEST(Retention, WhatIsTooOldMakesRoomForTheRest) {
  EXPECT_THAT(jobs_to_remove({job("first", 1, 1), job("old", 40, 2)}, {.keep_for = days(30), .keep_bytes = 10}),
              ElementsAre("old"));
}

TEST(Retention, NeverRemovesWhatHasToStay) {
  const std::vector<KeptJob> jobs{job("a", 90, 1, false), job("b", 80, 2, false)};
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_for = days(1), .keep_bytes = 0}), IsEmpty());
  EXPECT_THAT(jobs_to_remove({}, {.keep_for = days(1), .keep_bytes = 0}), IsEmpty());
}

}  // namespace
}  // namespace scanrig
