#include "config/gpio_options.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "tests/unit/config/file_under_test.h"

namespace scanrig::config {
namespace {

class GpioOptionsTest : public FileUnderTest {
 protected:
  Result<RigConfig> read(const std::string& text) const {
    write(text);
    return read_rig_config(file_, std::filesystem::path(SCANRIG_SOURCE_DIR) / "config" / "drives");
  }
};

TEST_F(GpioOptionsTest, EveryWiredLineReachesItsPlace) {
  std::string text = shipped("rigs/example.toml");
  text = replaced(text, "# part_present =", "part_present =");
  text = replaced(text, "# flipped =", "flipped =");
  text = replaced(text, "lamp_amber = { line = \"LAMP_AMBER\" }",
                  "lamp_amber = { chip = \"gpiochip2\", offset = 5, active = \"low\" }");
  text = replaced(text, "{ line = \"STOP\", active = \"low\" }",
                  "{ chip = \"gpiochip0\", offset = 17, bias = \"pull-down\" }");
  text = replaced(text, "[calibration]", "[gpio]\nsocket = \"gpio.sock\"\n\n[calibration]");
  text = replaced(text, "pulse_us", "active = \"low\"\npulse_us");
  const auto rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->gpio_socket, folder_ / "gpio.sock");

  const auto panel = gpio_panel_options(*rig);
  EXPECT_EQ(panel.inputs.size(), 7u);
  EXPECT_EQ(panel.outputs.size(), 8u);
  const auto line_of = [](const auto& wired, auto field) {
    for (const auto& [one, line] : wired) {
      if (one == field) return line.contact();
    }
    return std::string();
  };
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::estop_ok), "ESTOP_OK");
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::guard_closed), "GUARD_OK");
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::start), "START");
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::stop), "gpiochip0:17");
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::reset), "RESET");
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::part_present), "PART_PRESENT");
  EXPECT_EQ(line_of(panel.inputs, &PanelInputs::flipped), "FLIPPED");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::red), "LAMP_RED");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::amber), "gpiochip2:5");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::green), "LAMP_GREEN");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::start_lamp), "START_LAMP");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::busy), "BUSY");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::flip_request), "FLIP");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::pass), "PASS");
  EXPECT_EQ(line_of(panel.outputs, &PanelOutputs::fail), "FAIL");

  const auto by_line = [](const auto& wired) { return wired.first == &PanelInputs::estop_ok; };
  EXPECT_TRUE(std::ranges::find_if(panel.inputs, by_line)->second.active_low);

  const auto stop = [](const auto& wired) { return wired.first == &PanelInputs::stop; };
  EXPECT_EQ(std::ranges::find_if(panel.inputs, stop)->second.bias, gpio::Bias::pull_down);

  const auto projector = gpio_projector_options(rig->projector);
  EXPECT_EQ(projector.pattern_line.name, "PROJ_TRIG");
  EXPECT_TRUE(projector.pattern_line.active_low);
  EXPECT_TRUE(projector.plain_line.value().active_low);
  EXPECT_EQ(projector.plain_line.value().name, "PROJ_PLAIN");
  EXPECT_EQ(projector.pulse, std::chrono::microseconds(15000));
}

TEST_F(GpioOptionsTest, EveryChannelOfAModuleReachesItsPlace) {
  std::string text = shipped("rigs/example.toml");
  const auto begin = text.find("\n[panel]") + 1, end = text.find("[calibration]");
  text.replace(begin, end - begin,
               "[panel]\ndriver = \"modbus-io\"\ndevice = \"/dev/io\"\nbaud = 19200\nparity = \"none\"\n"
               "unit_id = 3\nreply_timeout_ms = 40\npoll_ms = 15\nstart = { channel = 0 }\n"
               "reset = { channel = 1 }\n"
               "flipped = { channel = 2, active = \"low\" }\nlamp_red = { channel = 4 }\n\n");
  text = replaced(text, "line = \"ESTOP_OK\"", "channel = 6");
  text = replaced(text, "line = \"GUARD_OK\"", "channel = 7");
  const auto rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  const auto options = modbus_io_panel_options(*rig);
  EXPECT_EQ(options.line.device, "/dev/io");
  EXPECT_EQ(options.poll, std::chrono::milliseconds(15));
  std::map<int, bool PanelInputs::*> wired;
  for (const auto& [field, signal] : options.inputs) {
    wired[signal.active_low ? -signal.address : signal.address] = field;
  }
  EXPECT_EQ(wired.at(0), &PanelInputs::start);
  EXPECT_EQ(wired.at(-2), &PanelInputs::flipped);
  EXPECT_EQ(wired.at(-6), &PanelInputs::estop_ok);
  EXPECT_EQ(wired.at(-7), &PanelInputs::guard_closed);
  ASSERT_EQ(options.outputs.size(), 1u);
  EXPECT_EQ(options.outputs[0].first, &PanelOutputs::red);
  EXPECT_EQ(options.outputs[0].second.address, 4);
}

}  // namespace
}  // namespace scanrig::config
