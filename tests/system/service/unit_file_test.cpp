// The unit file checked by systemd's own tool, without a running systemd.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "daemon/service/run_daemon.h"

namespace {

const std::filesystem::path kUnit = std::filesystem::path(SCANRIG_SOURCE_DIR) / "systemd" / "scanrigd.service";
const std::filesystem::path kSocket = kUnit.parent_path() / "scanrigd.socket";

struct Ran {
  int code = -1;
  std::string output;
};

Ran run(const std::string& command) {
  Ran ran;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (!pipe) return ran;
  std::array<char, 4096> part{};
  while (const std::size_t count = ::fread(part.data(), 1, part.size(), pipe)) ran.output.append(part.data(), count);
  const int status = ::pclose(pipe);
  ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

class UnitFile : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run("systemd-analyze --version").code != 0) GTEST_SKIP() << "systemd-analyze is not installed here";
    folder_ = std::filesystem::temp_directory_path() / ("scanrig-unit-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  /// The unit with every `before` replaced, as a file of its own.
  std::filesystem::path changed(const std::string& before, const std::string& after) const {
    std::stringstream text;
    text << std::ifstream(kUnit).rdbuf();
    std::string unit = text.str();
    for (std::size_t at = 0; (at = unit.find(before, at)) != std::string::npos; at += after.size()) {
      unit.replace(at, before.size(), after);
    }
    const auto file = folder_ / "scanrigd.service";
    std::ofstream(file) << unit;
    return file;
  }

  std::filesystem::path folder_;
};

TEST_F(UnitFile, IsVerifiedBySystemdWithoutAWord) {
  // systemd checks that the programs exist: they are those of this build.
  const auto verified = run("systemd-analyze verify " + changed("/usr/bin", SCANRIG_PROGRAMS).string());
  EXPECT_EQ(verified.code, 0);
  EXPECT_EQ(verified.output, "");
}

TEST_F(UnitFile, TheSocketIsVerifiedBySystemdWithoutAWord) {
  changed("/usr/bin", SCANRIG_PROGRAMS);  // the service that it starts, beside it
  std::filesystem::copy(kSocket, folder_ / "scanrigd.socket");
  const auto verified = run("systemd-analyze verify " + (folder_ / "scanrigd.socket").string());
  EXPECT_EQ(verified.code, 0);
  EXPECT_EQ(verified.output, "");
}

std::string text_of(const std::filesystem::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// $RUNTIME_DIRECTORY of the daemon and of make-safe after it: the configuration is kept there.
TEST(UnitFiles, LeaveWhoeverMakesTheRigSafeTheConfigurationOfTheDaemonThatDied) {
  const auto service = text_of(kUnit);
  EXPECT_NE(service.find("\nRuntimeDirectory=scanrig\n"), service.npos);
  EXPECT_NE(service.find("\nRuntimeDirectoryPreserve=yes\n"), service.npos);
  EXPECT_NE(service.find("\nExecStopPost=/usr/bin/scanrigd --make-safe "), service.npos);
}

/// A service at its start limit stops the socket that triggers it [systemd.socket(5), systemd.unit(5)].
TEST(UnitFiles, LimitNeitherStartsNorTriggersSoThatTheSocketStays) {
  const auto service = text_of(kUnit), socket = text_of(kSocket);
  const auto limit = service.find("\nStartLimitIntervalSec=0\n");
  EXPECT_LT(limit, service.find("[Service]")) << "in [Unit], or it is not heard";
  EXPECT_NE(socket.find("\nTriggerLimitIntervalSec=0\n"), socket.npos);
  EXPECT_NE(socket.find("\nFlushPending=yes\n"), socket.npos) << "one who waits must not start it again and again";
}

/// exit_timeout of the daemon and the time its control loop takes before; see daemon/service/run_daemon.h.
TEST(UnitFiles, LeaveTheDaemonMoreTimeToEndThanItTakesItself) {
  const auto service = text_of(kUnit);
  const std::string key = "\nTimeoutStopSec=";
  const auto at = service.find(key);
  ASSERT_NE(at, service.npos);
  const auto seconds = std::chrono::seconds(std::stoi(service.substr(at + key.size())));
  constexpr auto kControlLoop = std::chrono::seconds(5);
  EXPECT_GT(seconds, scanrig::DaemonOptions{}.exit_timeout + kControlLoop);
}

TEST(UnitFiles, LetTheServiceOutliveAReconstructionThatTheKernelEnds) {
  const auto service = text_of(kUnit);
  for (const char* line : {"OOMPolicy=continue", "OOMScoreAdjust=-500", "MemoryMax=90%", "Nice=-5", "LimitCORE=0"}) {
    EXPECT_NE(service.find("\n" + std::string(line) + "\n"), service.npos) << line;
  }
}

TEST_F(UnitFile, AMistakeInItWouldBeNoticed) {
  const auto verified = run("systemd-analyze verify " + changed("Type=notify", "Type=whatever").string());
  EXPECT_NE(verified.output, "");
}

TEST_F(UnitFile, ItsExposureIsAtMostTwo) {
  const auto judged = run("systemd-analyze security --no-pager --offline=true --threshold=20 " + kUnit.string());
  EXPECT_EQ(judged.code, 0) << judged.output;
}

TEST_F(UnitFile, WithCapabilitiesTheExposureWouldBeTooHigh) {
  const auto open = changed("CapabilityBoundingSet=\n", "CapabilityBoundingSet=~\n");
  EXPECT_NE(run("systemd-analyze security --no-pager --offline=true --threshold=20 " + open.string()).code, 0);
}

}  // namespace
