#pragma once

#include <gmock/gmock.h>

#include <string>

#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {

inline const Error kNoReply{ErrorCode::timeout, "turntable: no reply"};

/// The station with helpers for tests of its safety rules.
class Safety : public Station {
 protected:
  void expect_refused(const std::string& why) {
    ASSERT_TRUE(refused);
    EXPECT_THAT(refused->message, testing::HasSubstr(why));
    EXPECT_TRUE(actions.empty());
  }
  void fault_and_stand() {
    tell(event::RigFailed{kNoReply});
    tell(event::Stopped{});
    tell(event::EstopWindowOver{});
  }
  /// The configuration with which the API may start.
  void allow_remote() { rules.remote = rules.guard = true; }
};

}  // namespace scanrig
