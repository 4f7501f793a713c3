#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "daemon/rig/make_safe.h"
#include "tests/slowness.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The process that makes the rig safe for a daemon whose turntable hangs; a script takes its place.
class MakeSafeProcess : public testing::Test {
 protected:
  MakeSafeProcess() { fs::create_directories(folder_); }
  ~MakeSafeProcess() override { fs::remove_all(folder_); }

  fs::path script(const std::string& text) const {
    auto file = folder_ / "program";
    std::ofstream(file) << "#!/bin/sh\n" << text << "\n";
    fs::permissions(file, fs::perms::owner_all);
    return file;
  }
  Result<void> run(const std::string& text) const {
    return make_safe_in_process(script(text), folder_ / "rig.toml", kSlowness * std::chrono::milliseconds(10'000));
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("make-safe" + std::to_string(::getpid()));
};

TEST_F(MakeSafeProcess, IsToldWhichRigAndThatADaemonHasThePort) {
  const auto wanted = fmt::format("--make-safe --beside-daemon --config {}", (folder_ / "rig.toml").string());
  EXPECT_TRUE(run(fmt::format("[ \"$*\" = \"{}\" ]", wanted)));
}

TEST_F(MakeSafeProcess, ATableThatStandsIsEnoughWhateverTheLampsDo) {
  EXPECT_TRUE(run("exit 0"));
  EXPECT_TRUE(run("exit 11"));
}

TEST_F(MakeSafeProcess, ATableThatMayBeMovingIsAnError) {
  const auto failed = run("exit 5");
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(failed.error().message, HasSubstr("exit code 5"));
  EXPECT_FALSE(run("kill -9 $$"));
}

TEST_F(MakeSafeProcess, OneThatCannotBeStartedIsNamed) {
  const auto failed = make_safe_in_process(folder_ / "none", folder_ / "rig.toml");
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::io);
  EXPECT_THAT(failed.error().message, HasSubstr("none"));
}

TEST_F(MakeSafeProcess, OneThatDoesNotEndIsKilled) {
  const auto failed =
      make_safe_in_process(script("exec sleep 600"), folder_ / "rig.toml", std::chrono::milliseconds(100));
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::timeout);
}

}  // namespace
}  // namespace scanrig
