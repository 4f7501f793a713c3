#include <algorithm>
#include <list>

#include "tests/system/daemon/programs.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

int code_of(ExitCode code) { return static_cast<int>(code); }

TEST_F(Programs, EndWithTheDocumentedCodeAndOneSentence) {
  const auto sentences = [&] { return std::ranges::count(output, '\n'); };
  EXPECT_EQ(scanrig({"no-such-verb"}), 2);
  EXPECT_EQ(scanrig({"status", "--socket", socket()}), 9);
  EXPECT_THAT(output, HasSubstr("api.sock"));
  EXPECT_EQ(sentences(), 1);
  EXPECT_EQ(scanrig({"reconstruct", folder_ / "nowhere"}), 3);
  EXPECT_THAT(output, HasSubstr("nowhere"));
  EXPECT_EQ(sentences(), 1);
  EXPECT_EQ(scanrig({"evaluate", folder_ / "nowhere"}), 3);
  EXPECT_THAT(output, HasSubstr("nowhere"));
  EXPECT_EQ(scanrig({"check-config", folder_ / "nowhere.toml"}), 3);
  EXPECT_THAT(output, HasSubstr("nowhere.toml"));
  EXPECT_EQ(sentences(), 1);
  EXPECT_EQ(scanrig({"check-config", folder_ / "nowhere.toml", "--json"}), 3);
  EXPECT_THAT(output, HasSubstr("scanrig: "));
  EXPECT_EQ(scanrig({"import", "stanford", "--pose", folder_ / "nowhere.conf", "--out", folder_ / "scan"}), 3);
  EXPECT_THAT(output, HasSubstr("nowhere.conf"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "scan"));
  for (const char* verb : {"meshes", "ply"}) {
    EXPECT_EQ(scanrig({"import", verb, folder_ / "nowhere.ply", folder_ / "gone.ply", "--out", folder_ / "scan"}), 3);
    EXPECT_THAT(output, HasSubstr("nowhere.ply"));
    EXPECT_EQ(sentences(), 1);
  }
  EXPECT_EQ(scanrig({"import", "meshes", folder_ / "nowhere.ply", "--out", folder_ / "scan"}), 3);
  EXPECT_THAT(output, HasSubstr("2 to 100 can be joined"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "scan"));
  EXPECT_EQ(scanrig({"acceptance", "sphere", "--diameter", "25", folder_ / "nowhere"}), 3);
  EXPECT_THAT(output, HasSubstr("nowhere"));
  EXPECT_EQ(sentences(), 1);
  EXPECT_EQ(scanrig({"acceptance", "sphere", "--diameter", "25", "--limit", "flatness=1", folder_ / "nowhere"}), 3);
  EXPECT_THAT(output, HasSubstr("limit flatness"));
  EXPECT_EQ(scanrig({"camera", "characterise", "--from", folder_ / "nowhere", "--config", folder_ / "none.toml"}), 3);
  EXPECT_THAT(output, HasSubstr("nowhere"));
  EXPECT_EQ(sentences(), 1);
  EXPECT_EQ(scanrig({"camera", "characterise", "--config", folder_ / "none.toml"}), 3);
  EXPECT_THAT(output, HasSubstr("none.toml"));
  boot("none");
  ask_until("status", [](const json& status) { return status["machine"] == "Halted" && status["activity"] == "none"; });
  EXPECT_EQ(scanrig({"start", "--socket", socket()}), 6);
  EXPECT_THAT(output, HasSubstr("Press Reset first"));
}

TEST_F(Programs, EveryVerbGivesUpOnADaemonThatWasStopped) {
  boot("none");
  ask_until("status", [](const json& status) { return status["machine"] == "Halted"; });
  daemon->signal(SIGSTOP);
  std::list<Process> clients;
  std::vector<std::filesystem::path> outputs;
  for (const std::vector<std::string>& verb : std::vector<std::vector<std::string>>{{"status"},
                                                                                    {"status", "--follow"},
                                                                                    {"start", "--follow"},
                                                                                    {"stop"},
                                                                                    {"jobs"},
                                                                                    {"health"},
                                                                                    {"export", "x"}}) {
    std::vector<std::string> command{SCANRIG_PROGRAM};
    command.insert(command.end(), verb.begin(), verb.end());
    command.insert(command.end(), {"--socket", socket()});
    outputs.push_back(folder_ / ("client" + std::to_string(outputs.size())));
    clients.emplace_back(command, outputs.back());
  }
  for (auto& client : clients) EXPECT_EQ(client.wait(), code_of(ExitCode::unreachable));
  for (const auto& file : outputs) {
    EXPECT_THAT(*read_file(file), HasSubstr("api.sock: the service has not responded within 15 s; check"));
  }
  daemon->signal(SIGCONT);
  EXPECT_EQ(scanrig({"status", "--socket", socket()}), 0) << output;
}

TEST_F(Programs, AnObjectThatWasNotTurnedOverGivesNoModel) {
  boot("auto", {"--same-rest"});
  ask_until("status", [](const json& status) { return status["job"].is_string(); });
  EXPECT_EQ(scanrig({"status", "--follow", "--socket", socket()}), code_of(ExitCode::no_model)) << output;
  EXPECT_THAT(output, HasSubstr("scanrig: job "));
}

TEST_F(Programs, AScanThatIsStoppedEndsForWhoFollowsIt) {
  boot("none");
  ask_until("status", [](const json& status) { return status["machine"] == "Halted" && status["activity"] == "none"; });
  ASSERT_EQ(scanrig({"reset", "--socket", socket()}), 0) << output;
  ask_until("status", [](const json& status) { return status["machine"] == "Operational.Ready"; });
  Process follower({SCANRIG_PROGRAM, "status", "--follow", "--json", "--socket", socket()}, folder_ / "followed");
  RealClock clock;
  const auto waits = [&] { return read_file(folder_ / "followed").value_or("").find("Waiting for a job."); };
  for (const auto end = Deadline::after(clock, kSlowness * std::chrono::seconds(60));
       waits() == std::string::npos && !end.expired(clock);) {
    clock.sleep_for(std::chrono::milliseconds(20));
  }
  ASSERT_EQ(scanrig({"start", "--socket", socket()}), 0) << output;
  ask_until("status", [](const json& status) { return status["activity"] == "waiting_for_flip"; });
  ASSERT_EQ(scanrig({"stop", "--socket", socket()}), 0) << output;
  EXPECT_EQ(follower.wait(), code_of(ExitCode::stopped)) << *read_file(folder_ / "followed");
  EXPECT_THAT(*read_file(folder_ / "followed"), HasSubstr("interrupted: Stop was pressed"));
}

TEST_F(Programs, WhatCannotBeWrittenIsTheDisk) {
  boot("none");
  ask_until("status", [](const json& status) { return status["machine"] == "Halted"; });
  ASSERT_EQ(scanrig({"queue", "--socket", socket()}), 0) << output;
  const auto id = output.substr(0, output.find('\n'));
  EXPECT_EQ(scanrig({"export", id, "--file", "scan.json", "--out", folder_ / "nowhere/copy", "--socket", socket()}),
            code_of(ExitCode::disk))
      << output;
  EXPECT_THAT(output, HasSubstr("nowhere/copy"));
}

}  // namespace
}  // namespace scanrig
