#include "daemon/service/safety_record.h"

#include <gmock/gmock.h>

#include <fstream>

#include "core/files.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using testing::HasSubstr;

class SafetyRecordTest : public testing::Test {
 protected:
  /// A process that starts, and ends cleanly if `clean`.
  std::optional<Latch> run(bool clean) {
    SafetyRecord record(folder_ / "state", [this] { return now_; });
    auto latch = record.begin();
    EXPECT_TRUE(latch) << latch.error().message;
    if (clean) {
      EXPECT_TRUE(record.end());
    }
    return latch.value_or(std::nullopt);
  }
  void pass(seconds time) {
    now_.boot += time;
    now_.wall += time;
  }
  void reboot() { now_ = {now_.boot_id + "+", seconds(20), now_.wall + seconds(60)}; }

  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ = own_folder();
  Moment now_{"boot", seconds(1000), seconds(1'790'000'000)};
};

TEST_F(SafetyRecordTest, ALatchIsReadBackByTheNextProcess) {
  EXPECT_EQ(run(true), std::nullopt);
  SafetyRecord record(folder_ / "state", [this] { return now_; });
  const Latch latch{"Turntable: stalled at 12 deg.", "turntable"};
  ASSERT_TRUE(record.store_latch(latch));
  EXPECT_EQ(run(true), latch);
  EXPECT_EQ(run(true), latch) << "a restart does not clear it";
  ASSERT_TRUE(record.store_latch(std::nullopt));
  EXPECT_EQ(run(true), std::nullopt);
}

TEST_F(SafetyRecordTest, ADamagedRecordIsALatch) {
  run(true);
  for (const char* const file : {"latch.json", "run.json"}) {
    ASSERT_TRUE(write_file_atomically(folder_ / "state" / file, "{ \"format\""));
    const auto latch = run(true);
    ASSERT_TRUE(latch) << file;
    EXPECT_THAT(latch->cause, HasSubstr(file));
    SafetyRecord record(folder_ / "state");
    ASSERT_TRUE(record.store_latch(std::nullopt));
  }
}

TEST_F(SafetyRecordTest, AnUnfinishedWriteIsALatch) {
  run(true);
  std::ofstream(folder_ / "state" / "latch.json.tmp4711") << "{";
  const auto latch = run(true);
  ASSERT_TRUE(latch);
  EXPECT_EQ(run(true), latch);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "state" / "latch.json.tmp4711"));
  SafetyRecord record(folder_ / "state");
  ASSERT_TRUE(record.store_latch(std::nullopt));
  EXPECT_EQ(run(true), std::nullopt);
}

TEST_F(SafetyRecordTest, ThreeUnexpectedEndsWithinFiveMinutesAreALatch) {
  for (int start = 0; start < 3; ++start) {
    EXPECT_EQ(run(false), std::nullopt) << start;
    pass(minutes(2));
  }
  const auto latch = run(false);
  ASSERT_TRUE(latch);
  EXPECT_EQ(latch->cause, "The service ended unexpectedly 3 times within 5 minutes.");
}

TEST_F(SafetyRecordTest, EndsLongAgoAndBeforeACleanEndDoNotCount) {
  for (int start = 0; start < 8; ++start) {
    EXPECT_EQ(run(false), std::nullopt) << start;
    pass(minutes(3));
  }
  pass(minutes(10));
  for (const bool clean : {true, false, false, true, false, false, false}) EXPECT_EQ(run(clean), std::nullopt);
}

TEST_F(SafetyRecordTest, PowerCutsCountTooAndASetClockDoesNotHideEnds) {
  for (int start = 0; start < 3; ++start) {
    EXPECT_EQ(run(false), std::nullopt) << start;
    reboot();
  }
  EXPECT_TRUE(run(false));
  SafetyRecord record(folder_ / "state");
  ASSERT_TRUE(record.store_latch(std::nullopt));
  ASSERT_TRUE(record.end());
  for (int start = 0; start < 3; ++start) {
    EXPECT_EQ(run(false), std::nullopt) << start;
    now_.boot += seconds(10);
    now_.wall += std::chrono::years(start == 1 ? 10 : -10);
  }
  EXPECT_TRUE(run(false));
}

TEST_F(SafetyRecordTest, AFolderThatCannotBeMadeIsAnError) {
  std::ofstream(folder_ / "state") << "a file";
  SafetyRecord record(folder_ / "state");
  EXPECT_EQ(record.begin().error().code, ErrorCode::io);
}

TEST_F(SafetyRecordTest, TheWriterReturnsWhenTheLatchIsDurable) {
  SafetyRecord record(folder_ / "state");
  ASSERT_TRUE(record.begin());
  LatchWriter writer(record);
  for (int i = 0; i < 20; ++i) {
    const Latch latch{fmt::format("Fault {}.", i)};
    ASSERT_TRUE(writer.store(latch));
    EXPECT_THAT(read_file(folder_ / "state" / "latch.json").value(), HasSubstr(latch.cause));
  }
  ASSERT_TRUE(writer.store(std::nullopt));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "state" / "latch.json"));
}

}  // namespace
}  // namespace scanrig
