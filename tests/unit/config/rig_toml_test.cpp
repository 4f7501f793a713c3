#include "config/rig_toml.h"

#include <gmock/gmock.h>

#include "tests/unit/config/rig_file.h"

namespace scanrig::config {
namespace {

using testing::HasSubstr;
using testing::Not;

class RigToml : public RigFile {
 protected:
  /// `rig` written and read again; what is written from that must be the same text.
  RigConfig expect_same_again(const RigConfig& rig) const {
    const auto text = rig_toml(rig);
    const auto again = read(text);
    EXPECT_TRUE(again) << again.error().message << "\n" << text;
    if (!again) return {};
    EXPECT_EQ(rig_toml(*again), text);
    return *again;
  }
  RigConfig example() const { return read(example_).value(); }
};

TEST_F(RigToml, TheExampleIsReadAsItWas) {
  const auto rig = example();
  const auto again = expect_same_again(rig);
  EXPECT_EQ(again.safety.estop.line, "ESTOP_OK");
  EXPECT_TRUE(again.safety.estop.active_low);
  EXPECT_TRUE(again.safety.guard);
  EXPECT_EQ(again.turntable.modbus.profile.name, "leadshine-rs");
  EXPECT_EQ(again.turntable.modbus.line.parity, modbus::Parity::none);
  EXPECT_EQ(again.turntable.motion().scale.gear_ratio, 90.0);
  EXPECT_EQ(again.turntable.motion().home_mode, "switch");
  EXPECT_EQ(again.projector.plain_line.value().line, "PROJ_PLAIN");
  EXPECT_EQ(again.stereo_camera.aravis.right.address, "192.168.10.12");
  EXPECT_EQ(again.panel.inputs.size(), rig.panel.inputs.size());
  EXPECT_EQ(again.panel.outputs.size(), rig.panel.outputs.size());
  EXPECT_EQ(again.storage.root, rig.storage.root);
  EXPECT_EQ(again.api.socket, rig.api.socket);
}

TEST_F(RigToml, EveryKindOfTurntableIsWritten) {
  auto rig = example();
  rig.turntable.modbus.line.parity = modbus::Parity::even;
  rig.turntable.modbus.scale.positive_ccw = false;
  rig.turntable.modbus.scale.gear_ratio = 88.8125;
  const auto drive = expect_same_again(rig);
  EXPECT_EQ(drive.turntable.modbus.line.parity, modbus::Parity::even);
  EXPECT_FALSE(drive.turntable.motion().scale.positive_ccw);
  EXPECT_EQ(drive.turntable.motion().scale.gear_ratio, 88.8125);
  rig.turntable.driver = TurntableConfig::Driver::grbl;
  rig.turntable.grbl.drive.link.device = "/dev/serial/by-id/usb-\"quoted\"";
  rig.turntable.grbl.home_mode = "here";
  rig.turntable.grbl.scale.pulses_per_motor_rev = GrblDrive::kPulsesPerMotorRev;
  const auto controller = expect_same_again(rig);
  EXPECT_EQ(controller.turntable.device(), "/dev/serial/by-id/usb-\"quoted\"");
  EXPECT_EQ(controller.turntable.motion().home_mode, "here");
}

TEST_F(RigToml, EveryKindOfProjectorIsWritten) {
  using Driver = ProjectorConfig::Driver;
  auto rig = example();
  rig.projector.lightcrafter = {.image = 3, .pattern = 2, .depth = 1, .led_current = {10, 20, 30}};
  rig.projector.lightcrafter.exposure = std::chrono::microseconds(20'000);
  rig.projector.serial = "LCR-7";
  for (const auto driver : {Driver::lightcrafter4500, Driver::camera_strobe, Driver::gpio}) {
    rig.projector.driver = driver;
    EXPECT_EQ(expect_same_again(rig).projector.driver, driver);
  }
  rig.projector.driver = Driver::manual;
  rig.stereo_camera.aravis.trigger_source = "Software";
  EXPECT_EQ(expect_same_again(rig).projector.driver, Driver::manual);
}

TEST_F(RigToml, AnIoModuleHasChannels) {
  auto rig = example();
  rig.panel.driver = PanelConfig::Driver::modbus_io;
  rig.panel.io_module.device = "/dev/scanrig/panel";
  rig.panel.inputs.clear();
  rig.panel.outputs.clear();
  const auto channel = [](int number, bool active_low) {
    Pin pin;
    pin.channel = number;
    pin.active_low = active_low;
    return pin;
  };
  rig.panel.inputs = {{"start", channel(0, false)}, {"reset", channel(2, true)}};
  rig.panel.outputs = {{"lamp_red", channel(5, false)}};
  rig.safety.estop = channel(3, false);
  rig.safety.guard.reset();
  rig.projector.driver = ProjectorConfig::Driver::modbus_io;
  rig.projector.line = channel(6, false);
  rig.projector.plain_line = channel(7, false);
  const auto again = expect_same_again(rig);
  EXPECT_EQ(again.panel.inputs.at("reset").channel, 2);
  EXPECT_TRUE(again.panel.inputs.at("reset").active_low);
  EXPECT_EQ(again.projector.plain_line.value().channel, 7);
  EXPECT_FALSE(again.safety.guard);
}

TEST_F(RigToml, V4l2CamerasAreNamedByDeviceOrSerialNumber) {
  auto rig = example();
  rig.stereo_camera.driver = StereoCameraConfig::Driver::v4l2;
  rig.stereo_camera.v4l2.left = {.serial = "L1", .device = ""};
  rig.stereo_camera.v4l2.pixel_format = "RGGB";
  rig.stereo_camera.v4l2.size = {1280, 1024};
  rig.stereo_camera.v4l2.right = V4l2SensorOptions{.serial = "", .device = "/dev/video2"};
  const auto again = expect_same_again(rig);
  EXPECT_EQ(again.stereo_camera.v4l2.left.serial, "L1");
  EXPECT_EQ(again.stereo_camera.v4l2.right.value().device, "/dev/video2");
  EXPECT_EQ(again.stereo_camera.v4l2.size.width, 1280);
}

TEST_F(RigToml, AKeyThatAPersonMayChangeHasAComment) {
  EXPECT_THAT(rig_toml(example()), HasSubstr("# motor turns per table turn"));
}

TEST_F(RigToml, WhatIsNotAboutDevicesStaysAsItIsWritten) {
  auto old = example();
  old.turntable.modbus.scale.gear_ratio = 77;
  old.api.tokens = "/ours/tokens.json";
  old.api.http_port = 8090;
  old.storage.root = "/ours/jobs";
  old.gpio_socket = "/ours/gpio.sock";
  const std::string recipe =
      "# Small parts first.\n[recipe.small]\nviews = 4  # few\nposes = 1\nflip_timeout_min = 30\n";
  const auto present = rig_toml(old) + "\n" + recipe;
  auto found = example();
  found.turntable.modbus.scale.gear_ratio = 90;
  const auto text = with_other_tables(rig_toml(found), present);
  for (const auto& kept : {recipe, std::string("root = \"/ours/jobs\""), std::string("http_port = 8090")})
    EXPECT_THAT(text, HasSubstr(kept));
  for (const auto* gone : {"gear_ratio = 77", "gpio.sock"}) EXPECT_THAT(text, Not(HasSubstr(gone)));
  const auto again = read(text);
  ASSERT_TRUE(again) << again.error().message << "\n" << text;
  EXPECT_EQ(again->turntable.motion().scale.gear_ratio, 90);
  EXPECT_EQ(again->recipes.at("small").views, 4);
  EXPECT_EQ(again->api.http_port, 8090);
  EXPECT_EQ(with_other_tables(text, text), text) << "done twice, the same";
}

}  // namespace
}  // namespace scanrig::config
