#include "daemon/station/snapshot.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

using std::chrono::seconds;

TEST(EventCounter, CountsViewsRetriesAndFaults) {
  EventCounter tally;
  const Clock::TimePoint now{};
  tally.see(event::ViewStored{{"job", 0, 0}, 0.0, {2, {ErrorCode::timeout, "left camera: no frame"}}}, now);
  tally.see(event::ViewStored{{"job", 0, 1}, 45.0}, now);
  tally.see(event::MovementChecked{"job", {.retake_reasons = {{ErrorCode::protocol, "right camera: torn"}}}}, now);
  tally.see(event::EstopChanged{false}, now);
  tally.see(event::EstopChanged{true}, now);
  tally.see(event::RigFailed{{ErrorCode::timeout, "late"}}, now);
  tally.see(event::RigFailed{{ErrorCode::stalled, "stuck"}}, now);
  EXPECT_EQ(tally.counters().views_stored, 2u);
  EXPECT_EQ(tally.counters().retakes, 3u);
  EXPECT_EQ(tally.counters().faults, 3u) << "an e-stop that is released is none";
  EXPECT_EQ(tally.counters().deadlines_missed, 1u);
}

TEST(EventCounter, AStageLastsFromItsFirstWordToItsLast) {
  EventCounter tally;
  const Clock::TimePoint begun{};
  tally.see(event::StageProgress{"job", "volume", 0.0}, begun);
  tally.see(event::StageProgress{"job", "volume", 0.5}, begun + seconds(1));
  EXPECT_TRUE(tally.counters().stage_seconds.empty()) << "it is not over";
  tally.see(event::StageProgress{"job", "volume", 1.0}, begun + seconds(3));
  tally.see(event::StageProgress{"next", "volume", 0.0}, begun + seconds(10));
  tally.see(event::StageProgress{"next", "volume", 1.0}, begun + seconds(12));
  EXPECT_DOUBLE_EQ(tally.counters().stage_seconds.at("volume"), 5.0);
}

TEST(EventCounter, JobsAreCountedByTheirEnd) {
  EventCounter tally;
  tally.see(JobEnd{"a", JobState::done});
  tally.see(JobEnd{"b", JobState::failed});
  tally.see(JobEnd{"c", JobState::failed});
  EXPECT_EQ(tally.counters().jobs_ended, (std::map<std::string, std::uint64_t>{{"done", 1}, {"failed", 2}}));
}

}  // namespace
}  // namespace scanrig
