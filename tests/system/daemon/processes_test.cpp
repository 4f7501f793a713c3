#include "tests/system/daemon/programs.h"

#include <regex>

#include "core/files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

TEST_F(Programs, AKilledDaemonLosesNoAcknowledgedViewAndTheJobIsInterrupted) {
  for (const int views : {1, 3, 5}) {
    fs::remove_all(folder_ / "jobs");
    boot("auto");
    const auto before = job_with_views(views);
    ASSERT_TRUE(before.is_object());
    daemon->signal(SIGKILL);
    daemon->wait();

    boot("none");  // the stale socket is in its way
    const auto after = job_with_views(views);
    EXPECT_EQ(after["id"], before["id"]);
    EXPECT_EQ(after["state"], "interrupted") << views << " views";
    EXPECT_GE(after["stored"].size(), before["stored"].size());
    expect_readable(before);
    daemon.reset();
  }
}

TEST_F(Programs, SigtermInTheMiddleOfAScanIsACleanEnd) {
  boot("auto");
  const auto before = job_with_views(2);
  ASSERT_TRUE(before.is_object());
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(), 0) << *read_file(folder_ / "daemon.log");
  EXPECT_FALSE(fs::exists(socket()));
  EXPECT_EQ(ScanFolder::open(before["folder"].get<std::string>())->manifest().state, "interrupted");
  expect_readable(before);
}

TEST_F(Programs, FollowTellsEveryViewAndEndsWithThePaths) {
  boot("auto");
  ask_until("status", [](const json&) { return true; });
  EXPECT_EQ(scanrig({"status", "--follow", "--socket", socket()}), 0) << output;
  for (const auto* view : {"pose 1/2  view 1/4", "pose 1/2  view 4/4", "pose 2/2  view 1/4", "pose 2/2  view 4/4"}) {
    EXPECT_THAT(output, HasSubstr(view));
  }
  EXPECT_THAT(output, HasSubstr("range"));
  EXPECT_THAT(output, HasSubstr("100 %"));
  EXPECT_THAT(output, HasSubstr("model.glb"));
  EXPECT_THAT(output, HasSubstr("report.json"));
}

TEST_F(Programs, AnObjectLargerThanTheWorkingVolumeWritesNothing) {
  EXPECT_EQ(Process({SCANRIGD_SIM_PROGRAM, "--height-mm", "900", "--jobs", folder_ / "jobs", "--socket", socket()},
                    folder_ / "output")
                .wait(),
            3);
  EXPECT_FALSE(fs::exists(folder_ / "jobs"));
  EXPECT_THAT(*read_file(folder_ / "output"), HasSubstr("scanrigd-sim: "));
}

TEST_F(Programs, AJobIsQueuedShownCancelledAndRemovedFromTheCommandLine) {
  boot("none");
  ask_until("status", [](const json& status) { return status["machine"] == "Halted"; });
  ASSERT_EQ(scanrig({"queue", "--part", "bolt 7", "--repeat", "2", "--socket", socket()}), 0) << output;
  const std::string id = output.substr(0, output.find('\n'));
  EXPECT_EQ(ask_until("status", [](const json& s) { return s["queue"].size() == 2; })["queue"][0], id);
  ASSERT_EQ(scanrig({"jobs", id, "--json", "--socket", socket()}), 0) << output;
  EXPECT_EQ(json::parse(output)["part"], "bolt 7");
  EXPECT_EQ(scanrig({"files", id, "--socket", socket()}), 0);
  EXPECT_THAT(output, HasSubstr("scan.json"));
  EXPECT_EQ(scanrig({"export", id, "--file", "scan.json", "--out", folder_ / "copy.json", "--socket", socket()}), 0)
      << output;
  EXPECT_EQ(json::parse(*read_file(folder_ / "copy.json"))["id"], id);
  EXPECT_EQ(scanrig({"delete", id, "--yes", "--socket", socket()}), 6) << "it has not ended: " << output;
  EXPECT_EQ(scanrig({"cancel", id, "--socket", socket()}), 0) << output;
  EXPECT_EQ(scanrig({"jobs", "--state", "cancelled", "--socket", socket()}), 0);
  EXPECT_THAT(output, HasSubstr(id));
  EXPECT_EQ(scanrig({"bundle", id, "--out", folder_ / "job.tar.gz", "--socket", socket()}), 0) << output;
  EXPECT_GT(fs::file_size(folder_ / "job.tar.gz"), 100u);
  EXPECT_EQ(scanrig({"delete", id, "--socket", socket()}), 6) << "without --yes";
  EXPECT_EQ(scanrig({"delete", id, "--yes", "--socket", socket()}), 0) << output;
  EXPECT_EQ(scanrig({"jobs", id, "--socket", socket()}), 3);
  EXPECT_EQ(scanrig({"queue", "--recipe", "no-such", "--socket", socket()}), 3) << output;
  for (const auto& entry : fs::directory_iterator(folder_ / "jobs")) {
    EXPECT_FALSE(entry.path().filename().string().starts_with(".bundle")) << entry.path();
  }
}

TEST_F(Programs, AStartWithACalibrationOfOtherCamerasIsRefusedByItsCode) {
  boot("none");
  const auto wait_for = [&](const char* what, const std::string& begin) {
    return ask_until("status", [&](const json& now) { return now[what].get<std::string>().starts_with(begin); });
  };
  wait_for("next_action", "Press Reset");
  ASSERT_EQ(scanrig({"reset", "--socket", socket()}), 0) << output;
  wait_for("machine", "Operational.Ready");
  const auto file = folder_ / "jobs" / "calibration.json";
  const auto own = *read_file(file);
  ASSERT_TRUE(write_file_atomically(file, std::regex_replace(own, std::regex("SIM-L"), "40012345")));
  wait_for("next_action", "Check the calibration: ");
  EXPECT_EQ(scanrig({"start", "--socket", socket()}), 6);
  EXPECT_THAT(output, HasSubstr("for the cameras 40012345 (left) and SIM-R (right), but the rig has SIM-L and SIM-R"));
  ASSERT_TRUE(write_file_atomically(file, own));
  wait_for("next_action", "Put a part on the table");
  EXPECT_EQ(scanrig({"start", "--socket", socket()}), 0) << output;
}

TEST_F(Programs, WatchTellsWhatChangesUntilItIsInterrupted) {
  boot("none");
  ask_until("status", [](const json& status) { return status["machine"] == "Halted"; });
  Process watch({SCANRIG_PROGRAM, "status", "--watch", "--socket", socket()}, folder_ / "watched");
  const auto watched = [&](const std::string& words) {
    RealClock clock;
    for (const auto end = Deadline::after(clock, kSlowness * std::chrono::seconds(20)); !end.expired(clock);
         clock.sleep_for(std::chrono::milliseconds(20))) {
      if (const auto text = read_file(folder_ / "watched"); text && text->find(words) != std::string::npos) return true;
    }
    return false;
  };
  EXPECT_TRUE(watched("Halted  (none)"));
  EXPECT_TRUE(watched("disk "));
  daemon->signal(SIGTERM);
  daemon->wait();
  EXPECT_TRUE(watched("is the service running?")) << "it goes on without one";
  watch.signal(SIGINT);
  EXPECT_EQ(watch.wait(), 0);
  EXPECT_THAT(*read_file(folder_ / "watched"), Not(HasSubstr("\x1b"))) << "a file is no terminal";
}

TEST_F(Programs, TokensAreMadeListedAndRevoked) {
  const std::string file = folder_ / "tokens.json";
  ASSERT_EQ(scanrig({"token", "add", "tablet", "--role", "operator", "--file", file}), 0) << output;
  const auto token = output.substr(0, output.find('\n'));
  EXPECT_THAT(token, testing::StartsWith("scanrig_"));
  EXPECT_EQ(scanrig({"token", "add", "tablet", "--file", file}), 3) << "the name is taken";
  EXPECT_EQ(scanrig({"token", "list", "--json", "--file", file}), 0);
  EXPECT_EQ(json::parse(output)["tokens"][0]["role"], "operator");
  EXPECT_THAT(output + *read_file(file), Not(HasSubstr(token.substr(8))));
  EXPECT_EQ(scanrig({"token", "revoke", "tablet", "--file", file}), 0) << output;
  EXPECT_EQ(scanrig({"token", "revoke", "tablet", "--file", file}), 3);
}

#ifdef SICK_STAGE_LIBRARY
TEST_F(Programs, AReconstructionWhoseStageThrowsSaysSoInsteadOfCrashing) {
  ASSERT_EQ(Process({SCANRIG_SIM_PROGRAM, "shoot", "--poses", "1", "--views", "2", "--scale", "0.25", "--out",
                     folder_ / "scan"},
                    folder_ / "output")
                .wait(),
            0)
      << *read_file(folder_ / "output");
  scan_samples::write_text(folder_ / "sick", "throw");
  const int code = Process({"/usr/bin/env", std::string("LD_PRELOAD=") + SICK_STAGE_LIBRARY,
                            "SICK_STAGE=" + (folder_ / "sick").string(), SCANRIG_PROGRAM, "reconstruct",
                            folder_ / "scan", "--lines"},
                           folder_ / "output")
                       .wait();
  EXPECT_EQ(code, static_cast<int>(exit_code(ErrorCode::internal)));
  EXPECT_THAT(*read_file(folder_ / "output"),
              HasSubstr("failed\tinternal\tthe reconstruction failed: a stage that throws"));
  EXPECT_FALSE(fs::exists(folder_ / "scan" / "model"));
}
#endif

}  // namespace
}  // namespace scanrig
