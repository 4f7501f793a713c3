#include <gmock/gmock.h>

#include <map>
#include <vector>

#include "tests/unit/config/rig_file.h"

namespace scanrig::config {
namespace {

using testing::HasSubstr;

/// After the daemon's death, problems elsewhere in the file must not cost time.
class DeviceConfigTest : public RigFile {
 protected:
  void SetUp() override {
    RigFile::SetUp();
    std::filesystem::copy(drives_, folder_ / "drives");
  }
  /// The example, with a fault in these sections.
  void break_in(const std::vector<std::string>& sections) const {
    auto text = example_;
    for (const auto& section : sections) text = replaced(text, "\n" + section, "\n" + section + "\nunknown = 1");
    write(text);
  }
  Result<RigConfig> read(SafetyDevice device) const { return read_device_config(device, file_, "/elsewhere"); }
};

TEST_F(DeviceConfigTest, IsReadWhateverIsWrongWithTheRest) {
  break_in({"[stereo_camera]", "[recipe.default]", "[storage]", "[api]"});
  const auto turntable = read(SafetyDevice::turntable), projector = read(SafetyDevice::projector);
  const auto panel = read(SafetyDevice::panel);
  ASSERT_TRUE(turntable && projector && panel);
  EXPECT_EQ(turntable->turntable.device(), "/dev/scanrig/turntable");
  EXPECT_EQ(turntable->turntable.profile_file->name, "leadshine-rs.toml");
  EXPECT_EQ(projector->projector.line.line, "PROJ_TRIG");
  EXPECT_EQ(panel->safety.estop.line, "ESTOP_OK");
  EXPECT_EQ(panel->panel.inputs.at("start").line, "START");
}

TEST_F(DeviceConfigTest, APanelThatCouldNeverStartAJobCanStillShowRed) {
  write(replaced(example_, "reset = { line", "# reset = { line"));
  EXPECT_TRUE(read(SafetyDevice::panel));
  EXPECT_FALSE(read_rig_config(file_, drives_));
}

TEST_F(DeviceConfigTest, AProjectorOnThePanelsModuleFindsItWhateverElseIsWrongThere) {
  const std::string module =
      "[panel]\ndriver = \"modbus-io\"\ndevice = \"/dev/io\"\nbaud = 9600\nparity = \"even\"\nunit_id = 3\n"
      "reply_timeout_ms = 100\nunknown = 1\n";
  const auto text = with_section("[panel]", "[calibration]", module);
  const auto begin = text.find("\n[projector]") + 1;
  write(text.substr(0, begin) + "[projector]\ndriver = \"modbus-io\"\nchannel = 8\npulse_us = 15000\nwarm_up_s = 0\n" +
        text.substr(text.find("\n[stereo_camera]")));
  const auto projector = read(SafetyDevice::projector);
  ASSERT_TRUE(projector) << projector.error().message;
  EXPECT_EQ(projector->projector.io_module.device, "/dev/io");
  EXPECT_EQ(projector->projector.io_module.unit_id, 3);
}

TEST_F(DeviceConfigTest, IsRefusedForItsOwnSectionOnly) {
  const std::map<SafetyDevice, std::string> own{{SafetyDevice::turntable, "[turntable]"},
                                                {SafetyDevice::projector, "[projector]"},
                                                {SafetyDevice::panel, "[panel]"}};
  for (const auto& [device, section] : own) {
    break_in({section});
    for (const auto& [other, its] : own) EXPECT_EQ(read(other).has_value(), other != device) << section << its;
    EXPECT_THAT(read(device).error().message, HasSubstr(section + " unknown: unknown key"));
  }
  break_in({"[safety]"});
  EXPECT_FALSE(read(SafetyDevice::panel)) << "e-stop and guard are the panel's";
}

TEST_F(DeviceConfigTest, HasItsRelativePathsStartWhereItIsTold) {
  write(example_ + "\n[gpio]\nsocket = \"gpio.sock\"\n");
  EXPECT_EQ(read(SafetyDevice::panel)->gpio_socket, "/elsewhere/gpio.sock");
  EXPECT_EQ(read(SafetyDevice::projector)->gpio_socket, "/elsewhere/gpio.sock");
  std::filesystem::remove(file_);
  EXPECT_EQ(read(SafetyDevice::panel).error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace scanrig::config
