#include "drivers/panel/gpio_panel.h"

#include <gmock/gmock.h>

#include "tests/component/gpio/gpio_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class GpioPanelTest : public GpioBench {
 protected:
  std::unique_ptr<GpioPanel> panel_;

  void open(bool start_pressed = false) {
    // Start and e-stop are wired to ground: pressed and closed are low.
    start({{"START", !start_pressed}, {"STOP", false}, {"ESTOP_OK", false}, {"LAMP_GREEN", false}});
    const GpioPanelOptions options{{{&PanelInputs::start, {"START", true}},
                                    {&PanelInputs::stop, {"STOP"}},
                                    {&PanelInputs::estop_ok, {"ESTOP_OK", true}}},
                                   {{&PanelOutputs::green, {"LAMP_GREEN"}}}};
    auto opened = GpioPanel::open(options, *lines_, clock_);
    ASSERT_TRUE(opened) << opened.error().message;
    panel_ = std::move(*opened);
  }
  PanelInputs wait(const PanelInputs& known, int ms) {
    const auto inputs = panel_->wait_change(known, within(ms));
    EXPECT_TRUE(inputs);
    return inputs.value_or(PanelInputs{});
  }
};

TEST_F(GpioPanelTest, AtRestNothingIsPressedAndWhatIsNotWiredIsAtRest) {
  open();
  const PanelInputs rest;
  EXPECT_EQ(wait(rest, 20), rest);
}

TEST_F(GpioPanelTest, APressCountsOnceItHasHeld) {
  open();
  const auto pressed_at = clock_.now();
  far_end_->set("START", false);
  EXPECT_TRUE(wait({}, 1000).start);
  EXPECT_GE(clock_.now() - pressed_at, PanelDebounce::kMinimumPress - milliseconds(1));
}

TEST_F(GpioPanelTest, ABounceIsNoPress) {
  open();
  far_end_->set("STOP", true);
  EXPECT_EQ(wait({}, 20), PanelInputs{});
  far_end_->set("STOP", false);
  EXPECT_EQ(wait({}, 120), PanelInputs{});
}

TEST_F(GpioPanelTest, AnOpenedEmergencyStopCountsAtOnce) {
  open();
  far_end_->set("ESTOP_OK", true);
  // Shorter than any debouncing.
  EXPECT_FALSE(wait({}, 40).estop_ok);
}

TEST_F(GpioPanelTest, AButtonHeldSinceTheBeginningIsAFaultByNameUntilItIsReleased) {
  open(true);
  for (int i = 0; i < 3; ++i) {
    const auto stuck = panel_->wait_change({}, within(10));
    ASSERT_FALSE(stuck);
    EXPECT_EQ(stuck.error().code, ErrorCode::device_alarm);
    EXPECT_THAT(stuck.error().message, HasSubstr("Start"));
  }
  far_end_->set("START", true);
  while (!panel_->wait_change({}, within(10))) {
  }
  EXPECT_EQ(wait({}, 20), PanelInputs{});
  far_end_->set("START", false);
  EXPECT_TRUE(wait({}, 1000).start);
}

TEST_F(GpioPanelTest, APressShorterThanTheMinimumStartsNothing) {
  open();
  far_end_->set("START", false);
  EXPECT_EQ(wait({}, 70), PanelInputs{}) << "longer than a bounce, shorter than a press";
  far_end_->set("START", true);
  EXPECT_EQ(wait({}, 150), PanelInputs{});
}

TEST_F(GpioPanelTest, TheLampsStayWhenThePanelIsGivenBack) {
  open();
  ASSERT_TRUE(panel_->show({.green = true}, within(500)));
  panel_.reset();
  EXPECT_TRUE(far_end_->level("LAMP_GREEN"));
}

TEST_F(GpioPanelTest, LampsShow) {
  open();
  PanelOutputs outputs;
  outputs.green = outputs.red = true;
  ASSERT_TRUE(panel_->show(outputs, within(500)));
  EXPECT_TRUE(far_end_->level("LAMP_GREEN"));
  ASSERT_TRUE(panel_->show({}, within(500)));
  EXPECT_FALSE(far_end_->level("LAMP_GREEN"));
}

TEST_F(GpioPanelTest, LostLinesAreAnIoError) {
  open();
  far_end_.reset();
  const auto inputs = panel_->wait_change({}, within(500));
  ASSERT_FALSE(inputs);
  EXPECT_EQ(inputs.error().code, ErrorCode::io);
  EXPECT_EQ(panel_->show({}, within(500)).error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scanrig
