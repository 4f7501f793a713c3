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
                           "<Idle:x|MPos:0.000>",
                           "<Hold:x|MPos:0.000>",
                           "<Moving|MPos:0.000>",
                           "<Idle|MPos:0.0\x9a>",
                           "$100",
                           "$x=1",
                           "[MSG"}) {
    EXPECT_EQ(parse_line(line).kind, Kind::noise) << line;
  }
}

TEST(GrblProtocolTest, EveryAlarmAndErrorIsToldInWords) {
  constexpr std::array<std::pair<Firmware, int>, 3> kAlarms{
      {{Firmware::grbl, 10}, {Firmware::grblhal, 18}, {Firmware::fluidnc, 18}}};
  for (const auto& [firmware, last] : kAlarms) {
    for (int alarm = 1; alarm <= last; ++alarm)
      EXPECT_THAT(alarm_of(alarm, firmware).words, HasSubstr(fmt::format("(ALARM:{})", alarm)));
    for (int error = 1; error <= 38; ++error) {
      if (error == 18 || error == 19) continue;  // these numbers do not exist
      EXPECT_THAT(error_words(error, firmware), HasSubstr(fmt::format("(error:{})", error)));
    }
  }
  EXPECT_THAT(alarm_of(11, Firmware::grbl).words, HasSubstr("see the controller's manual"));
  EXPECT_TRUE(alarm_of(11, Firmware::grbl).wants_reset);
  EXPECT_THAT(error_words(46, Firmware::grblhal), HasSubstr("home it first"));
  EXPECT_THAT(error_words(46, Firmware::fluidnc), HasSubstr("error:46, unknown to FluidNC: see"));
  EXPECT_THAT(error_words(60, Firmware::grbl), HasSubstr("error:60, unknown to GRBL 1.1: see"));
}

/// The same number is a missed switch, an open e-stop or a spindle.
TEST(GrblProtocolTest, AnAlarmIsWhatTheFirmwareMeansByIt) {
  EXPECT_TRUE(alarm_of(10, Firmware::grbl).switch_not_found);
  EXPECT_FALSE(alarm_of(10, Firmware::grblhal).switch_not_found);
  EXPECT_TRUE(alarm_of(10, Firmware::grblhal).wants_reset);
  EXPECT_FALSE(alarm_of(11, Firmware::grblhal).wants_reset) << "homing ends it";
  EXPECT_FALSE(alarm_of(14, Firmware::fluidnc).wants_reset) << "homing ends it";
  EXPECT_FALSE(alarm_of(0, Firmware::grbl).wants_reset) << "none";
}

TEST(GrblProtocolTest, TheFirmwareIsNamedByItsGreetingOrBuild) {
  EXPECT_EQ(parse_line("Grbl 1.1h ['$' for help]").firmware, std::nullopt) << "grblHAL may say so too";
  EXPECT_EQ(parse_line("GrblHAL 1.1f ['$' or '$HELP' for help]").firmware, Firmware::grblhal);
  EXPECT_EQ(parse_line("Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]").firmware, Firmware::fluidnc);
  EXPECT_EQ(parse_line("[FIRMWARE:grblHAL]").firmware, Firmware::grblhal);
  EXPECT_EQ(parse_line("[VER:3.7 FluidNC v3.7.8:]").firmware, Firmware::fluidnc);
  EXPECT_EQ(parse_line("[MSG:INFO: FluidNC]").firmware, std::nullopt);
}

TEST(GrblProtocolTest, WhatTheOtherFirmwaresAddIsUnderstood) {
  const auto locked = parse_line("<Alarm:11|MPos:1.000,2.000,3.000,4.000,5.000,6.000,7.000,8.000|Bf:35,1024|FS:0,0>");
  ASSERT_EQ(locked.kind, Line::Kind::report);
  EXPECT_EQ(locked.report.state, State::alarm);
  EXPECT_FALSE(locked.report.underway);
  EXPECT_EQ(locked.report.position.size(), 8u);
  EXPECT_EQ(parse_line("<Run:1|MPos:1.000>").report.state, State::run);
  EXPECT_EQ(parse_line("<Tool|MPos:1.000>").report.state, State::tool);
  const auto address = parse_line("$302=192.168.5.1");
  EXPECT_EQ(address.kind, Line::Kind::setting);
  EXPECT_TRUE(std::isnan(address.value));
}

}  // namespace
}  // namespace scanrig::grbl
