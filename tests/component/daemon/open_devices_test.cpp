#include "daemon/rig/open_devices.h"

#include <gmock/gmock.h>

#include "daemon/rig/make_safe.h"
#include "sim/wire/modbus_io.h"

#include "tests/unit/config/rig_file.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// Rigs without any device plugged in.
class OpenDevicesTest : public config::RigFile {
 protected:
  /// The example with other cameras, so that no network search starts.
  void open(const std::string& projector = "") {
    std::string text = with_section("[stereo_camera]", "[panel]",
                                    "[stereo_camera]\ndriver = \"v4l2\"\nleft = { device = \"/dev/no-left\" }\n"
                                    "right = { device = \"/dev/no-right\" }\nexternal_trigger = true\n"
                                    "pixel_format = \"RGGB\"\nsize = { width = 320, height = 240 }\n"
                                    "exposure_us = 8000\nframe_timeout_ms = 400\n");
    if (!projector.empty()) {
      const auto begin = text.find("\n[projector]") + 1;
      text.replace(begin, text.find("\n[stereo_camera]") + 1 - begin, projector);
    }
    auto rig = read(text);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = std::move(*rig);
    auto opened = open_devices(rig_, clock_);
    ASSERT_TRUE(opened) << opened.error().message;
    devices_ = std::move(*opened);
  }
  static constexpr const char* kStrobe =
      "[projector]\ndriver = \"camera-strobe\"\nline = \"Line1\"\nplain_line = \"Line2\"\nwarm_up_s = 0\n";

  Deadline soon() { return Deadline::after(clock_, std::chrono::milliseconds(500)); }

  RealClock clock_;
  config::RigConfig rig_;
  OpenDevices devices_;
};

TEST_F(OpenDevicesTest, ACameraThatIsNotThereFailsByNameAtEveryUse) {
  open();
  const auto ready = devices_.camera->prepare(soon());
  ASSERT_FALSE(ready);
  EXPECT_EQ(ready.error().code, ErrorCode::not_found);
  EXPECT_THAT(ready.error().message, HasSubstr("left camera /dev/no-left"));
  EXPECT_FALSE(devices_.camera->arm(soon()));
  EXPECT_FALSE(devices_.camera->capture_preview(soon()));
}

TEST_F(OpenDevicesTest, AProjectorOnUsbThatIsNotThereFailsByNameAtEveryUse) {
  open(
      "[projector]\ndriver = \"lightcrafter4500\"\nserial = \"NONE-SUCH\"\nimage = 0\npattern = 0\ndepth_bits = 1\n"
      "led_current = { red = 1, green = 1, blue = 1 }\nexposure_us = 12000\nreply_timeout_ms = 100\nwarm_up_s = 0\n\n");
  for (int i = 0; i < 2; ++i) {
    const auto fired = devices_.projector->fire(Light::pattern, soon());
    ASSERT_FALSE(fired);
    EXPECT_THAT(fired.error().message, HasSubstr("LightCrafter"));
  }
  EXPECT_FALSE(devices_.projector->turn_off(soon()));
}

/// Light and lamps are switched at once, by two threads, and the module has one port.
TEST_F(OpenDevicesTest, AProjectorOnThePanelsModuleIsMadeDarkBesideARedLamp) {
  constexpr std::size_t kRed = 2, kDots = 5, kPlain = 6;
  sim::wire::ModbusIoModule io{8, 8};
  const auto module = sim::wire::ModbusServer::start(folder_ / "io", 3, io, clock_);
  ASSERT_TRUE(module) << module.error().message;
  io.write_coils(kDots, {true, true});
  const std::string port = "device = \"" + (folder_ / "io").string() +
                           "\"\nbaud = 115200\nparity = \"none\"\nunit_id = 3\nreply_timeout_ms = 50\n";
  std::string text = with_section("[projector]", "[stereo_camera]",
                                  "[projector]\ndriver = \"modbus-io\"\nchannel = 5\nplain_channel = 6\n"
                                  "pulse_us = 40000\nwarm_up_s = 0\n");
  const auto panel = text.find("\n[panel]") + 1;
  text.replace(panel, text.find("\n[calibration]") + 1 - panel,
               "[panel]\ndriver = \"modbus-io\"\n" + port +
                   "poll_ms = 20\nstart = { channel = 0 }\nreset = { channel = 1 }\nlamp_red = { channel = 2 }\n\n");
  text = replaced(text, "{ line = \"ESTOP_OK\", active = \"low\" }", "{ channel = 7 }");
  text = replaced(text, "{ line = \"GUARD_OK\", active = \"low\" }", "{ channel = 6 }");
  write(text);
  const auto of = [&](config::SafetyDevice device) { return config::read_device_config(device, file_, folder_); };
  const DeviceConfigs configs{of(config::SafetyDevice::turntable), of(config::SafetyDevice::projector),
                              of(config::SafetyDevice::panel)};
  ASSERT_TRUE(configs.projector) << configs.projector.error().message;
  const auto made = make_safe(configs, clock_, Deadline::after(clock_, std::chrono::seconds(5)));
  EXPECT_TRUE(made.projector) << made.projector.error().message;
  EXPECT_TRUE(made.panel) << made.panel.error().message;
  EXPECT_TRUE(io.coil(kRed));
  EXPECT_FALSE(io.coil(kDots) || io.coil(kPlain));
}

TEST_F(OpenDevicesTest, AProjectorOnACameraFailsByNameUntilTheCameraIsConnected) {
  const auto rig = read(with_section("[projector]", "[stereo_camera]", kStrobe));
  ASSERT_TRUE(rig) << rig.error().message;
  const auto opened = open_devices(*rig, clock_);
  ASSERT_TRUE(opened) << opened.error().message;
  const auto fired = opened->projector->fire(Light::pattern, Deadline::after(clock_, std::chrono::seconds(5)));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::io);
  EXPECT_THAT(fired.error().message, HasSubstr("projector: left camera 40012345"));
  const auto off = opened->projector->turn_off(soon());
  ASSERT_FALSE(off);
  EXPECT_THAT(off.error().message, HasSubstr("the light may be on"));
}

/// The camera ends its light itself, and may still belong to the process that died.
TEST_F(OpenDevicesTest, AProjectorOnACameraIsSafeWithoutTheCamera) {
  write(with_section("[projector]", "[stereo_camera]", kStrobe));
  const auto config = config::read_device_config(config::SafetyDevice::projector, file_, folder_);
  ASSERT_TRUE(config) << config.error().message;
  const Result<config::RigConfig> none = fail(ErrorCode::not_found, "not of this test");
  const auto made = make_safe({none, config, none}, clock_, Deadline::after(clock_, std::chrono::seconds(5)));
  EXPECT_TRUE(made.projector) << made.projector.error().message;
}

TEST_F(OpenDevicesTest, SimulatedCamerasAreTheirOwners) {
  write(with_section("[stereo_camera]", "[panel]",
                     "[stereo_camera]\ndriver = \"simulated\"\ntruth = \"control.sock\"\nexposure_us = 12000\n"));
  const auto rig = config::read_rig_config(file_, drives_, config::Cameras::or_simulated);
  ASSERT_TRUE(rig) << rig.error().message;
  const auto opened = open_devices(*rig, clock_);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_FALSE(opened->camera);
}

}  // namespace
}  // namespace scanrig
