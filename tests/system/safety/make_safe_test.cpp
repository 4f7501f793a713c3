#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/ctl/client.h"
#include "tests/component/safety/wire_rig.h"
#include "tests/slowness.h"
#include "tests/system/daemon/process.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

/// The shipped daemon, and scanrigd --make-safe called like by systemd: when the daemon has died.
class MakeSafe : public testing::Test {
 protected:
  void boot(const char* program = SCANRIGD_PROGRAM, std::vector<std::string> more = {}) {
    std::vector<std::string> command{program, "--config", rig.config()};
    command.insert(command.end(), more.begin(), more.end());
    daemon.emplace(command, rig.folder / "daemon.log");
    ASSERT_TRUE(rig.wait_halted()) << *read_file(rig.folder / "daemon.log");
  }
  int make_safe() {
    return Process({SCANRIGD_PROGRAM, "--make-safe", "--config", rig.config()}, rig.folder / "make_safe.log").wait();
  }
  void kill_while_turning() {
    rig.press("RESET");
    ASSERT_TRUE(rig.wait_moving());
    daemon->signal(SIGKILL);
    daemon->wait();
    ASSERT_TRUE(rig.drive.truth().moving);
  }
  void write(const std::string& text) const { std::ofstream(rig.config()) << text; }
  void expect_safe() {
    EXPECT_EQ(make_safe(), 0) << log();
    EXPECT_FALSE(rig.drive.truth().moving);
    EXPECT_FALSE(rig.lamp("DOTS") || rig.lamp("PLAIN"));
    EXPECT_TRUE(rig.lamp("RED"));
  }
  std::string log() const { return *read_file(rig.folder / "make_safe.log"); }
  double seconds_since(Clock::TimePoint then) { return std::chrono::duration<double>(rig.clock.now() - then).count(); }

  WireRig rig{{}};
  const std::filesystem::path kept = rig.folder / "rig.running";
  std::optional<Process> daemon;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), text.npos) << from;
  return text.replace(text.find(from), from.size(), to);
}

TEST_F(MakeSafe, ADaemonKilledWhileTheTableTurnsLeavesItStoppedDarkAndRedWithinASecond) {
  boot();
  for (int round = 0; round < 2; ++round) {
    rig.press("RESET");
    ASSERT_TRUE(rig.wait_moving());
    rig.clock.sleep_for(milliseconds(700));  // full speed
    EXPECT_GT(std::abs(rig.drive.truth().speed_deg_s), 20);
    const auto killed = rig.clock.now();
    daemon->signal(SIGKILL);
    daemon->wait();
    EXPECT_EQ(make_safe(), 0) << *read_file(rig.folder / "make_safe.log");
    const double took = seconds_since(killed);
    fmt::print("killed to stopped and dark: {:.3f} s\n", took);
    EXPECT_LT(took, 1.0 * kSlowness);
    EXPECT_FALSE(rig.drive.truth().moving);
    EXPECT_FALSE(rig.lamp("DOTS") || rig.lamp("PLAIN"));
    EXPECT_TRUE(rig.lamp("RED"));
    EXPECT_FALSE(rig.lamp("GREEN") || rig.lamp("BUSY"));
    EXPECT_EQ(make_safe(), 0) << "a second time does no harm";

    const auto restarted = rig.clock.now();
    boot();
    rig.clock.sleep_for(milliseconds(300));
    EXPECT_TRUE(rig.moves(restarted).empty()) << "nothing moves after a restart";
    EXPECT_FALSE(rig.stops(restarted).empty());
  }
}

TEST_F(MakeSafe, SigtermWhileTheTableTurnsDoesTheSameByItself) {
  boot();
  rig.press("RESET");
  ASSERT_TRUE(rig.wait_moving());
  rig.clock.sleep_for(milliseconds(300));
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(), 0) << *read_file(rig.folder / "daemon.log");
  EXPECT_FALSE(rig.drive.truth().moving);
  EXPECT_FALSE(rig.lamp("DOTS"));
  EXPECT_TRUE(rig.lamp("RED"));
}

TEST_F(MakeSafe, TheExitCodeSaysWhatWasReachedAndItEndsInTimeAllTheSame) {
  rig.serial->vanish();
  auto begun = rig.clock.now();
  EXPECT_EQ(make_safe(), 5);
  EXPECT_LT(seconds_since(begun), 1.2 * kSlowness);
  EXPECT_THAT(*read_file(rig.folder / "make_safe.log"), HasSubstr("turntable"));
  EXPECT_TRUE(rig.lamp("RED")) << "the rest was reached";
  ASSERT_TRUE(rig.serial->come_back());
  rig.lines.reset();
  begun = rig.clock.now();
  EXPECT_EQ(make_safe(), 11);
  EXPECT_LT(seconds_since(begun), 1.2 * kSlowness);
  EXPECT_THAT(*read_file(rig.folder / "make_safe.log"), HasSubstr("panel"));
  std::filesystem::remove(rig.config());
  EXPECT_EQ(make_safe(), 3);
}

TEST_F(MakeSafe, WhateverBecomesOfTheFileTheDaemonsOwnConfigurationCounts) {
  const auto text = *read_file(rig.config());
  for (const auto& edited : {text + "\n[turntable\n", replaced(text, rig.device(), "/dev/no-such-port"),
                             replaced(text, "profile = ", "no_such_key = ")}) {
    write(text);
    boot();
    kill_while_turning();
    write(edited);
    expect_safe();
  }
  write(text);
  std::filesystem::remove_all(rig.folder / "jobs" / ".state");  // or the fourth start is latched
  boot();
  kill_while_turning();
  std::filesystem::remove(rig.config());
  std::filesystem::remove_all(rig.folder / "drives");
  expect_safe();
}

TEST_F(MakeSafe, TheServicesConfigurationIsKeptInTheFolderThatSystemdMakesForIt) {
  const auto runtime = rig.folder / "run";
  std::filesystem::create_directory(runtime);
  ::setenv("RUNTIME_DIRECTORY", runtime.c_str(), 1);
  boot();
  kill_while_turning();
  EXPECT_FALSE(std::filesystem::exists(kept)) << "the file's own folder may not be written to";
  std::filesystem::remove(rig.config());
  expect_safe();
  ::unsetenv("RUNTIME_DIRECTORY");
}

TEST_F(MakeSafe, ADaemonThatIsRefusedLeavesTheOtherOnesConfigurationAlone) {
  boot();
  write(replaced(*read_file(rig.config()), rig.device(), "/dev/no-such-port"));
  EXPECT_EQ(Process({SCANRIGD_PROGRAM, "--config", rig.config()}, rig.folder / "second.log").wait(), 6);
  kill_while_turning();
  expect_safe();
}

TEST_F(MakeSafe, ADaemonThatCannotKeepItsConfigurationDoesNotBegin) {
  ::setenv("RUNTIME_DIRECTORY", "/proc/none", 1);
  daemon.emplace(std::vector<std::string>{SCANRIGD_PROGRAM, "--config", rig.config()}, rig.folder / "daemon.log");
  ::unsetenv("RUNTIME_DIRECTORY");
  ASSERT_TRUE(rig.wait_for([&] {
    return read_file(rig.folder / "daemon.log")->find("scanrigd: cannot create the folder /proc/none") !=
           std::string::npos;
  })) << *read_file(rig.folder / "daemon.log");
  EXPECT_EQ(daemon->wait(), 4);
}

TEST_F(MakeSafe, WithNothingKeptADeviceBadlyConfiguredLeavesTheOthersToBeMadeSafe) {
  const auto text = *read_file(rig.config());
  boot();
  kill_while_turning();
  std::filesystem::remove_all(kept);
  write(replaced(text, "[panel]\n", "[panel]\nno_such_key = 1\n"));
  EXPECT_EQ(make_safe(), 11);
  EXPECT_FALSE(rig.drive.truth().moving);
  EXPECT_FALSE(rig.lamp("RED"));
  EXPECT_THAT(log(), HasSubstr("[panel] no_such_key: unknown key"));
  EXPECT_THAT(log(), HasSubstr("No saved configuration"));

  write(replaced(text, "[turntable]\n", "[turntable]\nno_such_key = 1\n") + "\n[recipe.quick]\nviews = 0\n");
  EXPECT_EQ(make_safe(), 5);
  EXPECT_TRUE(rig.lamp("RED"));
  EXPECT_THAT(log(), HasSubstr("[turntable] no_such_key: unknown key"));
  EXPECT_THAT(log(), testing::Not(HasSubstr("recipe"))) << "what has nothing to do with it";

  write("[turntable\n");
  EXPECT_EQ(make_safe(), 3);
}

TEST_F(MakeSafe, ASilentDriveIsToldToStopAndIsNotCalledStopped) {
  rig.serial->inject({sim::wire::WireFault::Kind::request_lost});
  const auto begun = rig.clock.now();
  EXPECT_EQ(make_safe(), 5);
  EXPECT_LT(seconds_since(begun), 1.3 * kSlowness);
}

TEST_F(MakeSafe, AbsentCamerasLeaveTheRestRunningAndShown) {
  boot();
  const auto status = ctl::send_request(rig.api(), "GET", "/api/v1/status");
  ASSERT_TRUE(status);
  rig.press("RESET");
  ASSERT_TRUE(rig.wait_ready()) << "homed without cameras";
  rig.press("START");
  nlohmann::json devices;
  ASSERT_TRUE(rig.wait_for([&] {
    devices = (*ctl::send_request(rig.api(), "GET", "/api/v1/status"))["devices"];
    const auto ok = [&](int i) { return devices[i]["ok"].get<bool>(); };
    return devices.size() == 4 && ok(0) && ok(1) && ok(3);  // a device that replied late is tried again
  }));
  EXPECT_EQ(devices[2]["name"], "camera");
  EXPECT_EQ(devices[2]["problem"]["code"], "not_found");
  EXPECT_THAT(devices[2]["problem"]["message"].get<std::string>(), HasSubstr("no-camera"));
  EXPECT_TRUE(rig.lamp("GREEN") && !rig.lamp("BUSY")) << "no job began";
}

TEST_F(MakeSafe, MaintenanceThroughTheApiHomesJogsAndLeavesTheTableUnhomed) {
  boot();
  const auto post = [&](const std::string& what, const std::string& body = "") {
    const auto answer = ctl::send_request(rig.api(), "POST", "/api/v1/maintenance/" + what, body);
    return answer ? std::string() : answer.error().message;
  };
  EXPECT_THAT(post("jog", R"({"by_deg": 5})"), HasSubstr("off"));
  EXPECT_EQ(post("on"), "");
  EXPECT_THAT(post("jog", R"({"to_deg": 5, "by_deg": 5})"), HasSubstr("to_deg or by_deg"));
  EXPECT_THAT(post("dance"), HasSubstr("nothing of that name"));
  EXPECT_THAT(post("home"), HasSubstr("panel"));
  rig.press("RESET");
  const auto activity = [&] { return (*ctl::send_request(rig.api(), "GET", "/api/v1/status"))["activity"]; };
  ASSERT_TRUE(rig.wait_for([&] { return activity() == "homing"; }));
  ASSERT_TRUE(rig.wait_for([&] { return activity() == "none"; }));
  EXPECT_EQ(post("jog", R"({"by_deg": -10, "speed_deg_s": 5})"), "");
  double fastest = 0.0;
  ASSERT_TRUE(rig.wait_for([&] {
    fastest = std::max(fastest, std::abs(rig.drive.truth().speed_deg_s));
    return fastest > 0 && activity() == "none";
  }));
  EXPECT_NEAR(std::remainder(rig.drive.truth().table_deg, 360.0), -10.0, 0.3);
  EXPECT_LT(fastest, 5.5);
  EXPECT_EQ(post("pulse"), "");
  EXPECT_TRUE((*ctl::send_request(rig.api(), "GET", "/api/v1/io"))["inputs"]["estop_ok"]);
  ASSERT_TRUE(rig.wait_for([&] { return activity() == "none"; }));
  EXPECT_EQ(post("off"), "");
  EXPECT_EQ((*ctl::send_request(rig.api(), "GET", "/api/v1/status"))["machine"], "Halted");
}

}  // namespace
}  // namespace scanrig
