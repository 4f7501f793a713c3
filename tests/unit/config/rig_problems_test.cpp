// What is reported about a rig.toml that cannot be used: values, unknown keys, damaged text, a missing file.
#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "tests/unit/config/rig_file.h"

namespace scanrig::config {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class RigProblems : public RigFile {};

TEST_F(RigProblems, EachKindOfProblemIsToldWithItsLineAndWhatIsAllowed) {
  expect_problem("baud = 115200", "baud = 115201",
                 "[turntable] baud: 115201 is not one of 9600, 19200, 38400, 57600, 115200");
  expect_problem("baud = 115200", "baud = \"fast\"", "[turntable] baud: must be a whole number");
  expect_problem("speed_deg_s = 45", "speed_deg_s = true", "[turntable] speed_deg_s: must be a number");
  expect_problem("settle_ms = 200", "settle_ms = -1", "[turntable] settle_ms: -1 is not between 0 and 10000");
  expect_problem("settle_ms = 200", "settle_ms = 0.5", "[turntable] settle_ms: must be a whole number");
  expect_problem("gear_ratio = 90.0", "gear_ratio = nan", "[turntable] gear_ratio: nan is not between 0.1 and 1000");
  expect_problem("remote_start = false", "remote_start = 0", "[safety] remote_start: must be true or false");
  expect_problem("positive = \"ccw\"", "positive = \"left\"", "[turntable] positive: \"left\" is not one of ccw, cw");
  expect_problem("line = \"PROJ_TRIG\"", "line = \"\"", "[projector] line: must not be empty");
  expect_problem("line = \"PROJ_TRIG\"", "line = 7", "[projector] line: must be a text in quotes");
  expect_problem("unit_id = 1\n", "", "[turntable] unit_id: missing", "[turntable]");
  expect_problem("mode = \"switch\"", "mode = \"wall\"",
                 "[turntable] home.mode: \"wall\" is not one of here, limit, switch");
  expect_problem("mode = \"switch\", ", "", "[turntable] home.mode: missing", "home = ");
  expect_problem("[recipe.default]", "[recipe.fast]", "[recipe] default: missing");
  expect_problem("views = 8", "views = 2", "[recipe.default] views: 2 is not between 3 and 72");
  expect_problem("schema = 1", "schema = 2", "schema: 2 is not one of 1");
  expect_problem("driver = \"modbus\"", "driver = \"tmcl\"", "[turntable] driver: \"tmcl\" is not one of modbus, grbl");
  expect_problem("home = { mode = \"switch\", offset_deg = 0.0 }", "home = 3", "[turntable] home: must be a table");
}

TEST_F(RigProblems, UnknownKeysAndSectionsAreProblems) {
  expect_problem(
      "settle_ms = 200", "settle_ms = 200\nsettle = 1",
      "[turntable] settle: unknown key; known here: acceleration_deg_s2, backlash_deg, baud, device, driver, "
      "gear_ratio, home, parity, positive, profile, pulses_per_motor_rev, reply_timeout_ms, rs485, settle_ms, "
      "soft_limits, speed_deg_s, tolerance_deg, unit_id",
      "settle = 1");
  expect_problem("offset_deg = 0.0", "offset_deg = 0.0, speed = 3",
                 "[turntable] home.speed: unknown key; known here: mode, offset_deg");
  const auto rig = read(example_ + "\n[extra]\na = 1\n");
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("extra: unknown key; known here: api, calibration"));
}

TEST_F(RigProblems, AllProblemsAreToldAtOnceInOrderOfLine) {
  std::string text = replaced(example_, "baud = 115200", "baud = 1");
  text = replaced(text, "estop = { line = \"ESTOP_OK\"", "estop = { line = 1");
  text = replaced(text, "voxel_mm = 0.25", "voxel_mm = 0");
  const auto rig = read(text);
  ASSERT_FALSE(rig);
  const std::string& told = rig.error().message;
  EXPECT_EQ(std::ranges::count(told, '\n'), 2);
  EXPECT_LT(told.find("[safety] estop.line"), told.find("[turntable] baud"));
  EXPECT_LT(told.find("[turntable] baud"), told.find("[reconstruction] voxel_mm"));
}

TEST_F(RigProblems, MoreThanTwentyProblemsAreCounted) {
  std::string text = "schema = 1\n";
  for (int i = 0; i < 30; ++i) text += fmt::format("unknown{} = 1\n", i);
  const auto rig = read(text);
  ASSERT_FALSE(rig);
  EXPECT_EQ(std::ranges::count(rig.error().message, '\n'), 20);
  EXPECT_THAT(rig.error().message, HasSubstr("\nand 20 more"));  // ten sections are missing, too
}

TEST_F(RigProblems, TextThatIsNotTomlIsToldWithItsLine) {
  const auto rig = read("schema = 1\n[safety\n");
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(rig.error().message, StartsWith(file_.string() + ":2: "));
}

TEST_F(RigProblems, KeysOfAHundredThousandPartsAreRefused) {
  std::string text = "a";
  for (int i = 0; i < 100'000; ++i) text += ".a";
  const auto rig = read(text + " = 1\n");
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(rig.error().message, AllOf(StartsWith(file_.string() + ":1: "), HasSubstr("too many")));
}

TEST_F(RigProblems, AMissingFileIsNotFound) {
  const auto rig = read_rig_config(folder_ / "absent.toml");
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().code, ErrorCode::not_found);
  EXPECT_THAT(rig.error().message, HasSubstr("absent.toml"));
}

/// Bytes lost, doubled, changed, lines swapped and dropped: never a crash, every refusal with file and line.
TEST_F(RigProblems, DamagedFilesAreRefusedOrReadButNeverCrash) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  static constexpr std::string_view kBytes("\0\"'=[]{}.#\n\r\t0123456789-+eE_xn\x80\xFF\xC3", 33);
  int refused = 0;
  for (int round = 0; round < 1000; ++round) {
    std::string text = example_;
    for (std::size_t change = 0; change <= below(4); ++change) {
      const std::size_t at = below(text.size());
      switch (below(5)) {
        case 0: text.erase(at, 1 + below(20)); break;
        case 1: text.insert(at, text.substr(below(text.size()), below(40))); break;
        case 2: text[at] = kBytes[below(kBytes.size())]; break;
        case 3: text.insert(at, 1 + below(300), kBytes[below(kBytes.size())]); break;
        default: text.resize(at + 1); break;
      }
    }
    const auto rig = read(text);
    if (rig) continue;
    ++refused;
    ASSERT_EQ(rig.error().code, ErrorCode::invalid_input);
    ASSERT_THAT(rig.error().message, StartsWith(file_.string() + ":"));
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace scanrig::config
