#include <gmock/gmock.h>

#include <sstream>

#include "tests/unit/config/rig_file.h"

namespace scanrig::config {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::HasSubstr;

/// Cameras and projector of a rig file.
class EyesConfigTest : public RigFile {
 protected:
  static constexpr const char* kV4l2 =
      "[stereo_camera]\ndriver = \"v4l2\"\nleft = { device = \"/dev/video0\" }\nright = { serial = \"R7\" }\n"
      "external_trigger = true\npixel_format = \"RG10\"\nsize = { width = 320, height = 240 }\nexposure_us = 8000\n"
      "frame_timeout_ms = 400\n";
  static constexpr const char* kLightCrafter =
      "[projector]\ndriver = \"lightcrafter4500\"\nimage = 3\npattern = 5\ndepth_bits = 8\n"
      "led_current = { red = 1, green = 2, blue = 255 }\nexposure_us = 12000\nreply_timeout_ms = 300\nwarm_up_s = 0\n";

  [[nodiscard]] std::string v4l2() const { return with_section("[stereo_camera]", "[panel]", kV4l2); }
  [[nodiscard]] std::string side_by_side() const {
    std::string text = replaced(v4l2(), "driver = \"v4l2\"", "driver = \"v4l2-side-by-side\"");
    text = replaced(text, "left = { device = \"/dev/video0\" }", "both = { device = \"/dev/video0\" }");
    return replaced(text, "right = { serial = \"R7\" }\n", "");
  }
  [[nodiscard]] std::string lightcrafter() const {
    return with_section("[projector]", "[stereo_camera]", kLightCrafter);
  }
  /// Alternative to a section, from the comments of the example.
  [[nodiscard]] std::string commented(const std::string& heading) const {
    const auto begin = example_.find("\n# " + heading) + 1;
    std::istringstream lines(example_.substr(begin, example_.find("\n\n", begin) - begin));
    std::string section;
    for (std::string line; std::getline(lines, line);) section += line.substr(2) + "\n";
    return section;
  }
};

TEST_F(EyesConfigTest, AravisCamerasTakeTheirOptions) {
  std::string text = replaced(example_, "# gain = 6.0", "black_level = 4\ngain = 6");
  text = replaced(text, "# region = { x = 0, y = 0, width = 1280", "region = { x = 8, y = 4, width = 640");
  text = replaced(text, "# idle_refresh_s = 10", "idle_refresh_s = 60");
  text = replaced(text, "\"Line0\", edge = \"rising\"", "\"Line0\", edge = \"falling\"");
  text = replaced(text, "clock = \"interval\"", "clock = \"ptp\"");
  const auto rig = read(replaced(text, "\"BayerRG8\"", "\"BayerGB12\""));
  ASSERT_TRUE(rig) << rig.error().message;
  const AravisOptions& options = rig->stereo_camera.aravis;
  EXPECT_EQ(options.right.serial, "40012346");
  EXPECT_EQ(options.right.address, "192.168.10.12");
  EXPECT_EQ(options.trigger_source, "Line0");
  EXPECT_TRUE(options.falling_edge);
  EXPECT_EQ(options.pixel_format, "BayerGB12");
  EXPECT_EQ(options.exposure, microseconds(12000));
  EXPECT_EQ(rig->stereo_camera.exposure, microseconds(12000));
  EXPECT_EQ(options.gain, 6.0);
  EXPECT_EQ(options.black_level, 4.0);
  ASSERT_TRUE(options.region);
  EXPECT_EQ(options.region->x, 8);
  EXPECT_EQ(options.region->y, 4);
  EXPECT_EQ(options.region->width, 640);
  EXPECT_EQ(options.region->height, 1024);
  EXPECT_EQ(options.packet_bytes, 8192);
  EXPECT_EQ(options.packet_delay, microseconds(20));
  EXPECT_EQ(options.frame_clock, TriggeringOptions::FrameClock::ptp);
  EXPECT_EQ(options.frame_timeout, milliseconds(500));
  EXPECT_EQ(options.idle_refresh, std::chrono::seconds(60));
}

TEST_F(EyesConfigTest, Usb3CamerasNeedNeitherAddressNorPackets) {
  std::string text = replaced(example_, ", address = \"192.168.10.11\"", "");
  text = replaced(text, ", address = \"192.168.10.12\"", "");
  const auto rig = read(replaced(text, "packet = {", "# packet = {"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->stereo_camera.aravis.left.address, "");
  EXPECT_EQ(rig->stereo_camera.aravis.packet_bytes, 0);
  EXPECT_FALSE(rig->stereo_camera.aravis.gain);
  EXPECT_FALSE(rig->stereo_camera.aravis.region);
}

TEST_F(EyesConfigTest, V4l2CamerasTakeTheirOptions) {
  const auto rig = read(replaced(v4l2(), "exposure_us = 8000",
                                 "exposure_us = 8000\ngain = 32\ncontrols = { 0x009A0901 = 1, 0x00980913 = -5 }"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->stereo_camera.driver, StereoCameraConfig::Driver::v4l2);
  const V4l2Options& options = rig->stereo_camera.v4l2;
  EXPECT_EQ(options.left.device, "/dev/video0");
  EXPECT_EQ(options.left.serial, "");
  ASSERT_TRUE(options.right);
  EXPECT_EQ(options.right->serial, "R7");
  EXPECT_EQ(options.right->device, "");
  EXPECT_TRUE(options.external_trigger);
  EXPECT_EQ(options.pixel_format, "RG10");
  EXPECT_EQ(options.size, cv::Size(320, 240));
  EXPECT_EQ(options.exposure, microseconds(8000));
  EXPECT_EQ(rig->stereo_camera.exposure, microseconds(8000));
  EXPECT_EQ(options.gain, 32);
  EXPECT_EQ(options.controls, (std::map<std::uint32_t, int>{{0x009A0901, 1}, {0x00980913, -5}}));
  EXPECT_EQ(options.frame_timeout, milliseconds(400));
}

TEST_F(EyesConfigTest, OneV4l2DeviceMayDeliverBothImages) {
  const auto rig = read(side_by_side());
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->stereo_camera.driver, StereoCameraConfig::Driver::v4l2_side_by_side);
  EXPECT_EQ(rig->stereo_camera.v4l2.left.device, "/dev/video0");
  EXPECT_FALSE(rig->stereo_camera.v4l2.right);
}

TEST_F(EyesConfigTest, OtherExposuresOfThePatternFitCameraAndLight) {
  EXPECT_TRUE(read(example_)->stereo_camera.pattern_exposures.empty());
  const std::string lit = replaced(example_, "pulse_us = 15000", "pulse_us = 96000");
  const auto with = [&](const std::string& list) {
    return replaced(lit, "# pattern_exposures_us = [96000, 3000]", "pattern_exposures_us = " + list);
  };
  const auto rig = read(with("[96000, 3000]"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->stereo_camera.pattern_factors(), (std::vector<double>{8.0, 0.25}));
  EXPECT_EQ(rig->stereo_camera.longest_exposure(), microseconds(96000));
  for (const char* bad : {"[12000]", "[5]", "[\"long\"]", "[900000]", "[3000, 3000]", "[3000, 6000, 24000]"}) {
    const auto refused = read(with(bad));
    ASSERT_FALSE(refused) << bad;
    EXPECT_THAT(refused.error().message, HasSubstr("[stereo_camera] pattern_exposures_us: ")) << bad;
  }
  const auto dark = read(replaced(with("[96000]"), "pulse_us = 96000", "pulse_us = 15000"));
  ASSERT_FALSE(dark);
  EXPECT_THAT(dark.error().message, HasSubstr("pulse_us: 15000 is shorter than the longest exposure of 96000"));
  const auto late = read(replaced(with("[600000]"), "pulse_us = 96000", "pulse_us = 700000"));
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("500 is not longer than the pattern_exposures_us of 600000"));
}

TEST_F(EyesConfigTest, WhatACameraCannotDoIsToldWithLineAndRange) {
  expect_problem("exposure_us = 12000", "exposure_us = 5",
                 "[stereo_camera] exposure_us: 5 is not between 10 and 1000000");
  expect_problem("# gain = 6.0", "black_level = -101",
                 "[stereo_camera] black_level: -101 is not between -100 and 10000");
  expect_problem("# gain = 6.0", "gain = 20000", "[stereo_camera] gain: 20000 is not between -100 and 10000");
  expect_problem("# region = { x = 0, y = 0, width = 1280", "region = { x = 0, y = 0, width = 8",
                 "[stereo_camera] region.width: 8 is not between 16 and 65535");
  expect_problem("size_bytes = 8192", "size_bytes = 500",
                 "[stereo_camera] packet.size_bytes: 500 is not between 576 and 16000");
  expect_problem("delay_us = 20", "delay_us = -1", "[stereo_camera] packet.delay_us: -1 is not between 0 and 100000");
  expect_problem("clock = \"interval\"", "clock = \"wall\"",
                 "[stereo_camera] clock: \"wall\" is not one of interval, ptp");
  expect_problem("\"Line0\", edge = \"rising\"", "\"Line0\", edge = \"up\"",
                 "[stereo_camera] trigger.edge: \"up\" is not one of rising, falling");
  expect_problem("frame_timeout_ms = 500\nclock", "frame_timeout_ms = 12\nclock",
                 "[stereo_camera] frame_timeout_ms: 12 is not longer than the exposure_us of 12000",
                 "frame_timeout_ms = 12");
  expect_problem("# idle_refresh_s = 10", "idle_refresh_s = 0",
                 "[stereo_camera] idle_refresh_s: 0 is not between 1 and 3600");
  const auto format = read(replaced(example_, "\"BayerRG8\"", "\"Mono12Packed\""));
  ASSERT_FALSE(format);
  EXPECT_THAT(format.error().message, HasSubstr("pixel_format: \"Mono12Packed\" is not one of Mono8, Mono10, "));
}

TEST_F(EyesConfigTest, WhatAV4l2CameraCannotDoIsToldWithLineAndRange) {
  expect_problem_in(v4l2(), "\"R7\"", "\"\"", "[stereo_camera] right.serial: must not be empty", "right = ");
  expect_problem_in(v4l2(), "{ serial = \"R7\" }", "{ device = \"/dev/video0\" }",
                    "[stereo_camera] right: is the same device as left", "right = ");
  expect_problem_in(v4l2(), "{ device = \"/dev/video0\" }", "{ serial = \"R7\" }",
                    "[stereo_camera] right: has the same serial number as left", "right = ");
  expect_problem_in(v4l2(), "{ serial = \"R7\" }", "{ serial = \"R7\", device = \"/dev/video1\" }",
                    "[stereo_camera] right.device: unknown key; known here: serial", "right = ");
  expect_problem_in(v4l2(), "external_trigger = true\n", "", "[stereo_camera] external_trigger: missing",
                    "[stereo_camera]\ndriver = \"v4l2\"");
  expect_problem_in(v4l2(), "\"RG10\"", "\"GREY\"",
                    "[stereo_camera] pixel_format: GREY is grey, and the blue screen needs a colour format, such as "
                    "RGGB");
  expect_problem_in(v4l2(), "\"RG10\"", "\"Y16\"",
                    "[stereo_camera] pixel_format: Y16 is grey, and the blue screen needs a colour format, such as "
                    "RGGB");
  expect_problem_in(v4l2(), "width = 320", "width = 0", "[stereo_camera] size.width: 0 is not between 16 and 65535");
  expect_problem_in(v4l2(), "exposure_us = 8000", "exposure_us = 50",
                    "[stereo_camera] exposure_us: 50 is not between 100 and 1000000");
  expect_problem_in(v4l2(), "exposure_us = 8000", "exposure_us = 8000\ngain = -1",
                    "[stereo_camera] gain: -1 is not between 0 and 65535", "gain = -1");
  expect_problem_in(v4l2(), "exposure_us = 8000", "exposure_us = 8000\ncontrols = { trigger = 1 }",
                    "[stereo_camera] controls.trigger: is not the number of a control, such as 0x009A0901",
                    "controls = ");
  expect_problem_in(v4l2(), "exposure_us = 8000", "exposure_us = 8000\ncontrols = { 0x009A0901 = \"on\" }",
                    "[stereo_camera] controls.0x009A0901: must be a whole number", "controls = ");
  expect_problem_in(side_by_side(), "width = 320", "width = 321",
                    "[stereo_camera] size: has no two halves: the width must be even", "size = ");
  const auto aravis_key = read(replaced(v4l2(), "exposure_us = 8000", "clock = \"ptp\"\nexposure_us = 8000"));
  ASSERT_FALSE(aravis_key);
  EXPECT_THAT(aravis_key.error().message, HasSubstr("[stereo_camera] clock: unknown key"));
}

TEST_F(EyesConfigTest, ALightCrafterTakesItsOptions) {
  const auto rig = read(replaced(lightcrafter(), "image = 3",
                                 "image = 3\nserial = \"LCR-17\"\ntrigger_out = { active = \"low\", delay_ns = -500 }\n"
                                 "trigger_in = { edge = \"falling\", delay_ns = 1000 }"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->projector.driver, ProjectorConfig::Driver::lightcrafter4500);
  EXPECT_EQ(rig->projector.serial, "LCR-17");
  const LightCrafterOptions& options = rig->projector.lightcrafter;
  EXPECT_EQ(options.image, 3);
  EXPECT_EQ(options.pattern, 5);
  EXPECT_EQ(options.depth, 8);
  EXPECT_EQ(options.led_current, (std::array<std::uint8_t, 3>{1, 2, 255}));
  EXPECT_EQ(options.exposure, microseconds(12000));
  EXPECT_TRUE(options.trigger_out_inverted);
  EXPECT_EQ(options.trigger_out_delay, std::chrono::nanoseconds(-500));
  EXPECT_EQ(options.trigger_in, dlpc350::LutEntry::Trigger::falling);
  EXPECT_EQ(options.trigger_in_delay, std::chrono::nanoseconds(1000));
  EXPECT_EQ(options.reply_timeout, milliseconds(300));
}

TEST_F(EyesConfigTest, WhatALightCrafterCannotDoIsToldWithLineAndRange) {
  const auto problem = [&](const std::string& from, const std::string& to, const std::string& what,
                           const std::string& line_with = "") {
    expect_problem_in(lightcrafter(), from, to, "[projector] " + what, line_with);
  };
  problem("image = 3", "image = 64", "image: 64 is not between 0 and 63");
  problem("pattern = 5", "pattern = 24", "pattern: 24 is not between 0 and 23");
  problem("depth_bits = 8", "depth_bits = 9", "depth_bits: 9 is not between 1 and 8");
  problem("blue = 255", "blue = 256", "led_current.blue: 256 is not between 0 and 255");
  problem("exposure_us = 12000", "exposure_us = 11999",
          "exposure_us: 11999 is shorter than the longest exposure of 12000 in [stereo_camera]");
  problem("exposure_us = 12000", "exposure_us = 20000000", "exposure_us: 20000000 is not between 235 and 10000000");
  problem("image = 3", "image = 3\ntrigger_out = { delay_ns = 3000 }",
          "trigger_out.delay_ns: 3000 is not between -20000 and 2700", "trigger_out");
  problem("image = 3", "image = 3\ntrigger_in = { delay_ns = 1 }", "trigger_in.edge: missing", "trigger_in");
  problem("image = 3", "image = 3\nline = \"P\"",
          "line: unknown key; known here: depth_bits, driver, exposure_us, image, led_current, pattern, "
          "reply_timeout_ms, serial, trigger_in, trigger_out, warm_up_s",
          "line = \"P\"");
}

TEST_F(EyesConfigTest, TheAlternativesInTheExampleAreReadAsTheyAreWritten) {
  auto rig = read(with_section("[projector]", "[stereo_camera]", commented("[projector]")));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->projector.driver, ProjectorConfig::Driver::lightcrafter4500);
  EXPECT_EQ(rig->projector.serial, "LCR4500-17");
  rig = read(with_section("[stereo_camera]", "[panel]", commented("[stereo_camera]")));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->stereo_camera.driver, StereoCameraConfig::Driver::v4l2);
  EXPECT_EQ(rig->stereo_camera.v4l2.left.device, "/dev/scanrig/left");
}

}  // namespace
}  // namespace scanrig::config
