#include "daemon/ctl/watch.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace scanrig::ctl {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const json kStatus = json::parse(R"({"machine": "Operational.SingleExecution", "activity": "scanning",
  "sentence": "Pose 1, view 3 of 8.", "cause": "Start was pressed.", "next_action": "", "may_be_moving": false})");
const json kHealth = json::parse(R"({"devices": [{"name": "turntable", "ok": true, "problem": null},
  {"name": "camera", "ok": false, "problem": {"code": "timeout", "message": "no reply"}}],
  "disk": {"bytes": 4294967296, "free_bytes": 1073741824}, "temperatures": [{"sensor": "cpu", "celsius": 51.4}],
  "deadlines_missed": 1, "retakes": 2, "faults": 3})");
const json kJob = json::parse(R"({"id": "j1", "state": "scanning", "part": "4711",
  "sentence": "Pose 1 of 2: 4 of 8 views stored.", "next_action": "", "poses": 2, "views": 8, "stored": [{}, {}, {},
  {"pose": 0, "view": 3, "retake_reasons": [{"code": "timeout", "message": "left camera: no frame in time"}]}],
  "movement_checks": [{"pose": 1, "retake_reasons": [{"code": "protocol", "message": "right camera: torn"}]}],
  "stages": [{"name": "range", "fraction": 0.5}], "error": null, "model": ""})");

TEST(Watch, ShowsStateJobStagesAndHealthOnOneScreen) {
  const auto lines = watch_lines(kStatus, kHealth, kJob);
  EXPECT_THAT(lines, Contains("Operational.SingleExecution  (scanning)"));
  EXPECT_THAT(lines, Contains("Pose 1, view 3 of 8."));
  EXPECT_THAT(lines, Contains("job j1 of 4711: scanning"));
  EXPECT_THAT(lines, Contains("  Pose 1 of 2: 4 of 8 views stored."));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("views stored"), HasSubstr("25 %"), HasSubstr("4 of 16"))));
  EXPECT_THAT(lines, Contains("  pose 1 view 4: an exposure was retaken: left camera: no frame in time"));
  EXPECT_THAT(lines, Contains("  pose 2 view 1 again: an exposure was retaken: right camera: torn"));
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("range"), HasSubstr("50 %"))));
  EXPECT_THAT(lines, Contains(AllOf(StartsWith("camera"), HasSubstr("no reply"))));
  EXPECT_THAT(lines, Contains("disk 1.0 GiB free, cpu 51 C"));
  EXPECT_THAT(lines, Contains("1 deadlines missed, 2 exposures retried, 3 faults"));
  EXPECT_THAT(lines, Not(Contains(StartsWith("next:"))));
  EXPECT_LE(lines.size(), 24u);
}

TEST(Watch, SaysWhatTheOperatorShallDoAndWarnsOfMotion) {
  auto status = kStatus;
  status["next_action"] = "Turn the object over.";
  status["may_be_moving"] = true;
  const auto lines = watch_lines(status, kHealth, nullptr);
  EXPECT_THAT(lines, Contains("next:    Turn the object over."));
  EXPECT_THAT(lines, Contains("THE TABLE MAY BE MOVING"));
  EXPECT_THAT(lines, Not(Contains(StartsWith("job"))));
}

}  // namespace
}  // namespace scanrig::ctl
