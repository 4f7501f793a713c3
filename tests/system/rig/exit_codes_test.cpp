#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// Result of a scan that was started over the API, for the client that started it.
class StartedOverTheApi : public RigOnWires {
 protected:
  void change_config(const std::string& from, const std::string& to) {
    auto text = read_file(folder_ / "rig.toml").value_or("");
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    ASSERT_TRUE(write_file_atomically(folder_ / "rig.toml", text.replace(at, from.size(), to)));
  }
  void get_ready() {
    change_config("remote_start = false", "remote_start = true");
    start_daemon();
    ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  }
  ExitCode start(std::vector<std::string> more) {
    more.insert(more.begin(), {SCANRIG_PROGRAM, "start", "--socket", folder_ / "api.sock"});
    const int code = Process(more, folder_ / "output").wait();
    output_ = read_file(folder_ / "output").value_or("");
    return static_cast<ExitCode>(code);
  }
};

TEST_F(StartedOverTheApi, AJobThatDoesNotFitOnTheDiskIsNotWaitedFor) {
  start_rig();
  change_config("reserve_gib = 1", "reserve_gib = 100000");
  get_ready();
  EXPECT_EQ(start({"--follow"}), ExitCode::disk) << output_;
  EXPECT_THAT(output_, HasSubstr("did not start: the disk of"));
  EXPECT_THAT(output_, HasSubstr("Next: Check the job disk."));
  EXPECT_EQ(jobs()[0]["state"], "queued") << "the next Start begins it";
  EXPECT_EQ(start({"--follow", "--json"}), ExitCode::disk) << output_;
}

TEST_F(StartedOverTheApi, AModelBeyondTheLimitsOfItsRecipeIsNoSuccess) {
  start_rig();
  change_config("poses = 2", "poses = 1\nlimits = { min_measured_share = 1.0 }");
  get_ready();
  EXPECT_EQ(start({"--follow"}), ExitCode::below_limits) << output_ << log();
  EXPECT_THAT(output_, HasSubstr("model.glb")) << "there is a model";
  EXPECT_THAT(output_, HasSubstr("does not pass: "));
  EXPECT_THAT(output_, HasSubstr("the recipe asks for 100.0"));
}

TEST_F(StartedOverTheApi, AnAbsentDeviceIsADeviceAndNoFile) {
  start_rig();
  change_config("truth = \"control.sock\"", "truth = \"nowhere.sock\"");
  get_ready();
  EXPECT_EQ(start({}), ExitCode::device) << output_;
  EXPECT_THAT(output_, HasSubstr("The camera is not responding: "));
}

}  // namespace
}  // namespace scanrig
