#include "drivers/projector/gpio_projector.h"

#include <gmock/gmock.h>

#include <thread>

#include "tests/component/gpio/gpio_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class GpioProjectorTest : public GpioBench {
 protected:
  std::unique_ptr<GpioProjector> projector_;

  void open(bool active_low = false, std::optional<gpio::LineSpec> plain = gpio::LineSpec{"PLAIN"}) {
    start({{"DOTS", false}, {"PLAIN", false}});
    auto opened = GpioProjector::open({{"DOTS", active_low}, plain, milliseconds(20)}, *lines_, clock_);
    ASSERT_TRUE(opened) << opened.error().message;
    projector_ = std::move(*opened);
  }
};

TEST_F(GpioProjectorTest, APatternIsOnePulseOnItsLineAndDarkAfterwards) {
  open();
  ASSERT_TRUE(projector_->fire(Light::pattern, within(500)));
  const auto edges = far_end_->edges();
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_EQ(edges[0].line, "DOTS");
  EXPECT_TRUE(edges[0].high);
  EXPECT_FALSE(edges[1].high);
  EXPECT_GE(edges[1].at - edges[0].at, milliseconds(19));
}

TEST_F(GpioProjectorTest, PlainLightHasItsOwnLine) {
  open();
  ASSERT_TRUE(projector_->fire(Light::plain, within(500)));
  const auto edges = far_end_->edges();
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_EQ(edges[0].line, "PLAIN");
}

TEST_F(GpioProjectorTest, PlainLightWithoutALineIsUnsupported) {
  open(false, std::nullopt);
  const auto fired = projector_->fire(Light::plain, within(500));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::unsupported);
}

TEST_F(GpioProjectorTest, AnActiveLowLineRestsHigh) {
  open(true);
  EXPECT_TRUE(far_end_->level("DOTS"));
  ASSERT_TRUE(projector_->fire(Light::pattern, within(500)));
  EXPECT_TRUE(far_end_->level("DOTS"));
  EXPECT_EQ(far_end_->edges().size(), 3u);  // the initial level, and the pulse
}

TEST_F(GpioProjectorTest, DarkOnRequestEndsThePulse) {
  open();
  std::thread onlooker;
  far_end_->on_edge([&](const auto& edge) {
    if (edge.high) onlooker = std::thread([&] { projector_->request_off(); });
  });
  const auto fired = projector_->fire(Light::pattern, within(500));
  far_end_->on_edge({});
  onlooker.join();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::io);
  EXPECT_FALSE(far_end_->level("DOTS"));
}

TEST_F(GpioProjectorTest, APulseThatDoesNotFitIsNotBegun) {
  open();
  const auto fired = projector_->fire(Light::pattern, within(5));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::timeout);
  EXPECT_TRUE(far_end_->edges().empty());
}

TEST_F(GpioProjectorTest, LostLinesAreIoErrorsThatSayTheLightMayBeOn) {
  open();
  far_end_.reset();
  const auto dark = projector_->turn_off(within(500));
  ASSERT_FALSE(dark);
  EXPECT_EQ(dark.error().code, ErrorCode::io);
  EXPECT_THAT(dark.error().message, HasSubstr("may be on"));
  EXPECT_EQ(projector_->fire(Light::pattern, within(500)).error().code, ErrorCode::io);
}

TEST_F(GpioProjectorTest, ALineThatIsNotThereIsNamed) {
  start({{"DOTS", false}});
  const auto opened = GpioProjector::open({{"DOTTS"}, std::nullopt}, *lines_, clock_);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::not_found);
  EXPECT_THAT(opened.error().message, HasSubstr("DOTTS"));
}

TEST_F(GpioProjectorTest, AMachineWithoutThatLineSaysSo) {
  const auto chips = gpio::chip_lines(clock_);
  const auto opened = GpioProjector::open({{"SCANRIG_NO_SUCH_LINE"}, std::nullopt}, *chips, clock_);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace scanrig
