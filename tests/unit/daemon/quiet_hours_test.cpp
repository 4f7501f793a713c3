#include <gtest/gtest.h>

#include "daemon/service/run_daemon.h"

namespace scanrig {
namespace {

using std::chrono::hours;
using std::chrono::minutes;

TEST(QuietHours, BeginAndEndOnOneDay) {
  const QuietHours noon{hours(12), hours(13)};
  EXPECT_FALSE(noon.contain(hours(12) - minutes(1)));
  EXPECT_TRUE(noon.contain(hours(12)));
  EXPECT_TRUE(noon.contain(hours(13) - minutes(1)));
  EXPECT_FALSE(noon.contain(hours(13)));
}

TEST(QuietHours, MayGoOverMidnight) {
  const QuietHours night{hours(22) + minutes(30), hours(6)};
  for (const auto of_day : {hours(22) + minutes(30), minutes(hours(0)), hours(6) - minutes(1)}) {
    EXPECT_TRUE(night.contain(of_day)) << of_day.count();
  }
  for (const auto of_day : {hours(22) + minutes(29), minutes(hours(6)), minutes(hours(12))}) {
    EXPECT_FALSE(night.contain(of_day)) << of_day.count();
  }
}

}  // namespace
}  // namespace scanrig
