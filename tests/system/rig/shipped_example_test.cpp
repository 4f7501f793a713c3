#include <gmock/gmock.h>

#include "sim/scene/optics.h"
#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

/// config/rigs/example.toml as shipped; only the places of its devices and folders differ.
class ShippedExample : public RigOnWires {
 protected:
  ShippedExample() { views_ = 8; }

  void write_shipped_file() {
    const auto source = read_file(std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/rigs/example.toml");
    ASSERT_TRUE(source) << source.error().message;
    text_ = *source;
    const auto rig = sim::default_rig();
    replace("\"/dev/scanrig/turntable\"", folder_ / "turntable");
    replace("left = { serial = \"40012345\", address = \"192.168.10.11\" }", address(rig.left.serial, "127.0.0.1"),
            "left = ");
    replace("right = { serial = \"40012346\", address = \"192.168.10.12\" }", address(rig.right.serial, "127.0.0.2"),
            "right = ");
    replace("\"/var/lib/scanrig/calibration.json\"", folder_ / "calibration.json");
    replace("\"/var/lib/scanrig/jobs\"", folder_ / "jobs");
    replace("\"/run/scanrig/api.sock\"", folder_ / "api.sock");
    text_ += "\n[gpio]\nsocket = \"" + (folder_ / "gpio.sock").string() + "\"\n";
    ASSERT_TRUE(write_file_atomically(folder_ / "rig.toml", text_));
  }

 private:
  static std::string address(const std::string& serial, const std::string& ip) {
    return "{ serial = \"" + serial + "\", address = \"" + ip + "\" }";
  }
  void replace(const std::string& from, const std::filesystem::path& to) { replace(from, '"' + to.string() + '"', ""); }
  void replace(const std::string& from, const std::string& to, const std::string& key) {
    const auto at = text_.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text_.replace(at, from.size(), key + to);
  }

  std::string text_;
};

TEST_F(ShippedExample, ScansAWholeJobFromResetToTheModel) {
  start_rig({"--cameras", "gige", "--scale", "0.25"});
  write_shipped_file();
  EXPECT_EQ(Process({SCANRIG_PROGRAM, "check-config", folder_ / "rig.toml"}, folder_ / "output").wait(), 0)
      << read_file(folder_ / "output").value_or("");
  start_daemon({SCANRIGD_PROGRAM});
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_TRUE(soon([&] { return lamp("lamp_green") && lamp("start_lamp") && !lamp("lamp_red"); })) << log();
  ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  ASSERT_TRUE(soon([&] { return lamp("flip_request") && lamp("lamp_amber"); }, std::chrono::seconds(120))) << log();
  ASSERT_EQ(say({{"turn_over", true}})["ok"], true);
  ASSERT_TRUE(press_until("start", [&] { return !lamp("flip_request"); })) << log();
  const auto ended = [&] {
    const auto all = jobs();
    return !all.empty() && (all[0]["state"] == "done" || all[0]["state"] == "failed");
  };
  ASSERT_TRUE(soon(ended, std::chrono::seconds(300))) << log() << jobs();
  ASSERT_EQ(jobs()[0]["state"], "done") << log() << jobs();
  EXPECT_TRUE(soon([&] { return lamp("pass"); })) << log();

  const auto job = ask("jobs/" + jobs()[0]["id"].get<std::string>());
  const auto scan = json::parse(*read_file(std::filesystem::path(job["folder"].get<std::string>()) / "scan.json"));
  ASSERT_EQ(scan["poses"].size(), 2u);
  for (const auto& pose : scan["poses"]) {
    ASSERT_EQ(pose["views"].size(), 8u);
    for (const auto& view : pose["views"]) EXPECT_EQ(view["pixel_format"], "BayerRG8");
  }
  EXPECT_TRUE(std::filesystem::exists(job["model"].get<std::string>()));
}

}  // namespace
}  // namespace scanrig
