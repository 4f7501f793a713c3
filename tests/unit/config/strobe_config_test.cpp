#include <gmock/gmock.h>

#include "config/gpio_options.h"
#include "tests/unit/config/rig_file.h"

namespace scanrig::config {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// The example with a projector that the left camera fires.
class StrobeConfigTest : public RigFile {
 protected:
  const std::string strobe_ = with_section("[projector]", "[stereo_camera]",
                                           "[projector]\ndriver = \"camera-strobe\"\nline = \"Line1\"\n"
                                           "plain_line = \"Line2\"\nwarm_up_s = 0\n");
};

TEST_F(StrobeConfigTest, TheOutputsReachProjectorAndCamera) {
  const auto rig = read(strobe_);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->projector.driver, ProjectorConfig::Driver::camera_strobe);
  EXPECT_THAT(rig->stereo_camera.aravis.strobe_outputs, ElementsAre("Line1", "Line2"));
  EXPECT_EQ(rig->stereo_camera.aravis.trigger_source, "Line0") << "of the right camera";
  const auto options = camera_strobe_options(*rig);
  EXPECT_EQ(options.pattern_output, "Line1");
  EXPECT_EQ(options.plain_output, "Line2");
  EXPECT_EQ(options.exposure, std::chrono::microseconds(12000)) << "of [stereo_camera]";
}

TEST_F(StrobeConfigTest, OtherProjectorsLeaveTheOutputsAlone) {
  const auto rig = read(example_);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_THAT(rig->stereo_camera.aravis.strobe_outputs, IsEmpty());
}

TEST_F(StrobeConfigTest, AnOutputMayHaveTheNameOfALineOfThePanel) {
  const auto rig = read(replaced(strobe_, "line = \"LAMP_RED\"", "line = \"Line1\""));
  EXPECT_TRUE(rig) << rig.error().message;
}

TEST_F(StrobeConfigTest, EveryViewNeedsPlainLight) {
  expect_problem_in(strobe_, "plain_line = \"Line2\"\n", "",
                    "[projector] plain_line: missing: every view needs a plain image; name the output that fires it",
                    "[projector]\n");
  expect_problem_in(strobe_, "\"Line2\"", "\"Line1\"", "[projector] plain_line: is on the same contact as line",
                    "plain_line = \"Line1\"");
  expect_problem_in(strobe_, "line = \"Line1\"", "line = \"\"", "[projector] line: must not be empty");
}

TEST_F(StrobeConfigTest, ThereIsNoPulseToBeSet) {
  expect_problem_in(strobe_, "warm_up_s = 0", "pulse_us = 15000\nwarm_up_s = 0",
                    "[projector] pulse_us: unknown key; known here: driver, line, plain_line, warm_up_s", "pulse_us");
}

TEST_F(StrobeConfigTest, OnlyAravisCamerasHaveIt) {
  const auto begin = strobe_.find("\n[stereo_camera]") + 1, end = strobe_.find("\n[panel]") + 1;
  std::string text = strobe_;
  text.replace(begin, end - begin,
               "[stereo_camera]\ndriver = \"v4l2\"\nleft = { device = \"/dev/video0\" }\n"
               "right = { device = \"/dev/video1\" }\nexternal_trigger = true\npixel_format = \"RGGB\"\n"
               "size = { width = 320, height = 240 }\nexposure_us = 8000\nframe_timeout_ms = 400\n\n");
  expect_problem_in(text, "driver = \"camera-strobe\"", "driver = \"camera-strobe\"",
                    "[projector] driver: \"camera-strobe\" needs driver = \"aravis\" in [stereo_camera]: only GigE and "
                    "USB3 Vision cameras have outputs that follow their exposure");
}

TEST_F(StrobeConfigTest, TheRightCameraIsTriggeredByTheOutputs) {
  expect_problem_in(strobe_, "source = \"Line0\", edge", "source = \"Software\", edge",
                    "[projector] driver: \"camera-strobe\" needs trigger.source in [stereo_camera] to be the right "
                    "camera's input that the outputs are wired to, not \"Software\"",
                    "driver = \"camera-strobe\"");
}

}  // namespace
}  // namespace scanrig::config
