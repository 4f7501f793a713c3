#include "daemon/rig/open_devices.h"

#include <gmock/gmock.h>

#include "tests/unit/config/rig_file.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// Rigs of which nothing is plugged in.
class OpenDevicesTest : public config::RigFile {
 protected:
  /// The example with other cameras, so that nothing is looked for on a network.
  void open(const std::string& projector = "") {
    std::string text = with_section("[stereo_camera]", "[panel]",
                                    "[stereo_camera]\ndriver = \"v4l2\"\nleft = { device = \"/dev/no-left\" }\n"
                                    "right = { device = \"/dev/no-right\" }\nexternal_trigger = true\n"
                                    "pixel_format = \"GREY\"\nsize = { width = 320, height = 240 }\n"
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
