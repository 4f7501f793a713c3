#include "drivers/turntable/grbl_protocol.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

// Lines as the wiki of gnea/grbl prints them [Interface].

namespace scanrig::grbl {
namespace {

using Kind = Line::Kind;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(GrblProtocolTest, StatusReportsOfTheWiki) {
  const Line idle = parse_line("<Idle|MPos:0.000,0.000,0.000|FS:0.0,0>");
  ASSERT_EQ(idle.kind, Kind::report);
  EXPECT_EQ(idle.report.state, State::idle);
  EXPECT_THAT(idle.report.position, ElementsAre(0, 0, 0));
  const Line run = parse_line("<Run|MPos:23.036,1.620,-0.001|FS:500,0>");
  EXPECT_EQ(run.report.state, State::run);
  EXPECT_THAT(run.report.position, ElementsAre(23.036, 1.620, -0.001));
  EXPECT_TRUE(parse_line("<Hold:1|MPos:5.000,0.000,0.000|Bf:15,128|FS:0,0>").report.underway);
  EXPECT_FALSE(parse_line("<Hold:0|MPos:5.000,0.000,0.000|Bf:15,128|FS:0,0>").report.underway);
  EXPECT_TRUE(parse_line("<Idle|WPos:1.000,0.000,0.000|FS:0,0>").report.position.empty());
}

TEST(GrblProtocolTest, AnswersAndWhatIsSaidUnasked) {
  EXPECT_EQ(parse_line("ok").kind, Kind::ok);
  EXPECT_EQ(parse_line("error:20").number, 20);
  EXPECT_EQ(parse_line("ALARM:9").kind, Kind::alarm);
  EXPECT_EQ(parse_line("Grbl 1.1f ['$' for help]").kind, Kind::banner);
  EXPECT_EQ(parse_line("[MSG:'$H'|'$X' to unlock]").kind, Kind::message);
  const Line steps = parse_line("$100=250.000");
  EXPECT_EQ(steps.kind, Kind::setting);
  EXPECT_EQ(steps.number, 100);
  EXPECT_EQ(steps.value, 250.0);
}

TEST(GrblProtocolTest, WhatIsNotUnderstoodToTheLastCharacterIsNoise) {
  for (const char* line : {"",
                           "o",
                           "OK",
                           "ok ",
                           "error:",
                           "error:9x",
                           "error:-1",
                           "ALARM:",
                           "<Idle|MPos:0.000,0.000",
                           "<Idle|MPos:0.000,,0.000>",
                           "<Idle|MPos:nan>",
                           "<Idle|MPos:>",
                           "<Idle|MPos:1|MPos:2>",
                           "<Idle:1|MPos:0.000>",
                           "<Hold:x|MPos:0.000>",
                           "<Moving|MPos:0.000>",
                           "<Idle|MPos:0.0\x9a>",
                           "$100",
                           "$100=",
                           "$x=1",
                           "[MSG"}) {
    EXPECT_EQ(parse_line(line).kind, Kind::noise) << line;
  }
}

TEST(GrblProtocolTest, EveryAlarmAndErrorIsToldInWords) {
  for (int alarm = 1; alarm <= 10; ++alarm)
    EXPECT_THAT(alarm_words(alarm), HasSubstr(fmt::format("(ALARM:{})", alarm)));
  for (int error = 1; error <= 38; ++error) {
    if (error == 18 || error == 19) continue;  // these numbers do not exist
    EXPECT_THAT(error_words(error), HasSubstr(fmt::format("(error:{})", error)));
  }
  EXPECT_THAT(alarm_words(11), HasSubstr("see the controller's manual"));
  EXPECT_THAT(error_words(60), HasSubstr("error:60, unknown to GRBL 1.1: see"));
}

}  // namespace
}  // namespace scanrig::grbl
