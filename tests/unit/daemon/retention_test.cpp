#include "daemon/jobs/retention.h"

#include <gmock/gmock.h>

namespace scanrig {
namespace {

using std::chrono::days;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::chrono::sys_days kToday(days(20'000));

KeptJob job(const std::string& id, int age_days, bool exported = false) {
  return {id, kToday - days(age_days), 10, exported};
}

TEST(Retention, KeepsEverythingUnlessToldOtherwise) {
  EXPECT_THAT(jobs_to_remove({job("a", 9000), job("b", 1)}, {}, kToday), IsEmpty());
}

TEST(Retention, RemovesWhatIsTooOld) {
  EXPECT_THAT(jobs_to_remove({job("new", 1), job("old", 40), job("older", 50)}, {.keep_for = days(30)}, kToday),
              ElementsAre("older", "old"));
}

TEST(Retention, MakesRoomByExportedJobsFirst) {
  const std::vector<KeptJob> jobs{job("a", 9), job("b", 8, true), job("c", 7), job("d", 6, true), job("e", 5)};
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_bytes = 40}, kToday), ElementsAre("b"));
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_bytes = 25}, kToday), ElementsAre("b", "d", "a"));
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_bytes = 50}, kToday), IsEmpty());
}

TEST(Retention, NeverRemovesTheNewestThatWasNotExported) {
  const std::vector<KeptJob> jobs{job("a", 90), job("b", 80), job("c", 70, true)};
  EXPECT_THAT(jobs_to_remove(jobs, {.keep_for = days(1), .keep_bytes = 0}, kToday), ElementsAre("c", "a"));
}

TEST(Retention, WithNothingThereNothingGoes) {
  EXPECT_THAT(jobs_to_remove({}, {.keep_for = days(1), .keep_bytes = 0}, kToday), IsEmpty());
}

}  // namespace
}  // namespace scanrig
