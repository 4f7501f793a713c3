#include "config/drive_profile_file.h"

#include <gmock/gmock.h>

#include "tests/unit/config/file_under_test.h"

namespace scanrig::config {
namespace {

using testing::HasSubstr;

class DriveProfileTest : public FileUnderTest {
 protected:
  const std::string shipped_ = shipped("drives/leadshine-rs.toml");

  void expect_problem(const std::string& from, const std::string& to, const std::string& problem) const {
    SCOPED_TRACE(to);
    write(replaced(shipped_, from, to));
    const auto profile = read_drive_profile(file_);
    ASSERT_FALSE(profile);
    EXPECT_EQ(profile.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(profile.error().message, HasSubstr(problem));
  }
};

TEST_F(DriveProfileTest, EveryShippedProfileIsRead) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SCANRIG_SOURCE_DIR "/config/drives")) {
    const auto profile = read_drive_profile(entry.path());
    EXPECT_TRUE(profile) << profile.error().message;
    EXPECT_EQ(profile->name, entry.path().stem());
    ++count;
  }
  EXPECT_GT(count, 0);
}

TEST_F(DriveProfileTest, RegistersAreThoseOfTheManual) {
  write(shipped_);
  const auto profile = read_drive_profile(file_);
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->move.address, 0x6200);
  EXPECT_EQ(profile->move.words.size(), 8u);
  EXPECT_EQ(profile->status.address, 0x1003);
  EXPECT_EQ(profile->status.fault, 0x01);
  EXPECT_EQ(profile->status.in_position, 0x30);
  EXPECT_EQ(profile->status.homed, 0x40);
  EXPECT_EQ(profile->stop.address, 0x6002);
  EXPECT_EQ(profile->stop.value, 0x40);
  EXPECT_EQ(profile->alarm.words.at(0x02).substr(0, 12), "over-voltage");
  EXPECT_EQ(profile->soft_limits->control_mask, 2);
}

TEST_F(DriveProfileTest, WhatDoesNotFitIsTold) {
  expect_problem("register = 0x6200", "register = 0x16200", "[move] register: 90624 is not between 0 and 65535");
  expect_problem("fault = [0]", "fault = [16]", "[status] fault: holds a bit that is not between 0 and 15");
  expect_problem("fault = [0]", "fault = []", "[status] fault: must name at least one bit");
  expect_problem("fault = [0]", "fault = 0", "[status] fault: must be a list in square brackets");
  expect_problem("fault = [0]", "fault = [0.5]", "[status] fault: may contain whole numbers and texts only");
  expect_problem("\"position_low\", ", "", "[move] words: must contain \"position_low\" exactly once");
  expect_problem("\"position_low\"", "\"position\"", "[move] words: \"position\" is neither a word");
  expect_problem("0x40 =", "fourty =", "[alarm.words] fourty: is not an alarm code");
  expect_problem("reset = \"register\"", "reset = \"hope\"",
                 "[alarm] reset: \"hope\" is not one of register, power_cycle");
  expect_problem("speed_unit = \"rpm\"", "speed_unit = \"mph\"", "speed_unit: \"mph\" is not one of rpm, pulses_per_s");
  expect_problem("value = 0x0040", "valeu = 0x0040",
                 "[stop] valeu: unknown key; known here: momentary, register, value");
}

TEST_F(DriveProfileTest, ValuesOf32BitsLieInTwoWordsAndInputsAreLetGo) {
  const auto profile = read_drive_profile(SCANRIG_SOURCE_DIR "/config/drives/oriental-az.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  using Word = DriveProfile::Block::Word;
  EXPECT_EQ(profile->move.address, 0x0058);
  EXPECT_EQ(profile->move.words.size(), 16u);
  for (const Word word : {Word::position, Word::speed, Word::acceleration, Word::deceleration}) {
    EXPECT_TRUE(profile->move.has(word, true) && profile->move.has(word, false));
  }
  EXPECT_TRUE(profile->stop.momentary);
  EXPECT_FALSE(profile->enable);
  EXPECT_FALSE(profile->soft_limits);
  EXPECT_EQ(profile->status.enabled, 0);
  EXPECT_EQ(profile->status.in_position, 1u << 5 | 1u << 14);
  EXPECT_EQ(profile->pulses_per_motor_rev.base, 1000);
}

TEST_F(DriveProfileTest, ADriveHasACommunicationTimeoutOrNone) {
  auto profile = read_drive_profile(SCANRIG_SOURCE_DIR "/config/drives/oriental-az.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  ASSERT_TRUE(profile->communication_timeout);
  EXPECT_EQ(profile->communication_timeout->timeout, std::chrono::milliseconds(3000));
  profile = read_drive_profile(SCANRIG_SOURCE_DIR "/config/drives/leadshine-rs.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_FALSE(profile->communication_timeout);
  expect_problem("[alarm]\n", "[communication_timeout]\nregister = 1\ntimeout_ms = 400\n\n[alarm]\n",
                 "[communication_timeout] timeout_ms: 400 is not between 500 and 10000");
}

TEST_F(DriveProfileTest, AMoveThatSaysHalfAValueIsNone) {
  expect_problem("\"acceleration\"", "\"acceleration_high\"",
                 "[move] words: must contain \"acceleration\", or \"acceleration_high\" and \"acceleration_low\"");
  expect_problem("\"acceleration\", \"dec", "\"acceleration_high\", \"acceleration_low\", \"dec",
                 "[move] words: must hold acceleration and deceleration in the same number of bits");
  expect_problem("\"speed\", \"acc", "\"slow_speed\", \"speed\", \"acc", "[move] words: holds \"slow_speed\"");
  expect_problem("{ multiply_register = 0x0001 }", "{}", "[pulses_per_motor_rev] multiply_register: is missing");
}

TEST_F(DriveProfileTest, APowerCycleNeedsNoResetRegister) {
  std::string text = replaced(shipped_, "reset = \"register\"", "reset = \"power_cycle\"");
  text = replaced(text, "reset_trigger", "#");
  write(text);
  const auto profile = read_drive_profile(file_);
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->alarm.reset, DriveProfile::Alarm::Reset::power_cycle);
}

}  // namespace
}  // namespace scanrig::config
