#include <gmock/gmock.h>

#include "tests/component/lightcrafter/lightcrafter_bench.h"

namespace scanrig {
namespace {

using Fault = sim::wire::LightCrafter::Fault;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;

std::unique_ptr<ProjectorBench> make_bench() { return std::make_unique<LightCrafterBench>(); }

INSTANTIATE_TEST_SUITE_P(LightCrafter, ProjectorCompliance, testing::Values(&make_bench));

class LightCrafterTest : public testing::Test {
 protected:
  LightCrafterBench bench_;
  Result<void> fire(Light light = Light::pattern) {
    return bench_.projector().fire(light, Deadline::after(bench_.clock(), std::chrono::seconds(2)));
  }
  void expect_fires() {
    const auto fired = fire();
    EXPECT_TRUE(fired) << fired.error().message;
  }
  std::size_t reports_for(Light light) {
    const auto before = bench_.device().received().size();
    EXPECT_TRUE(fire(light));
    return bench_.device().received().size() - before;
  }
};

TEST_F(LightCrafterTest, ShowsTheDotsOfTheImageInItsFlashWithTheCurrentsAskedFor) {
  expect_fires();
  ASSERT_EQ(bench_.device().flashes().size(), 1u);
  const auto flash = bench_.device().flashes().front();
  EXPECT_EQ(flash.image, 5);
  EXPECT_EQ(flash.pattern, 3);
  EXPECT_EQ(flash.depth, 1);
  EXPECT_EQ(flash.exposure, milliseconds(12));
  EXPECT_THAT(flash.current, ElementsAre(100, 100, 100));
}

/// Each command is a report and a reply, a few milliseconds on USB.
TEST_F(LightCrafterTest, AnotherLightTakesAFewCommandsMoreThanTheSame) {
  const auto first = reports_for(Light::pattern);
  EXPECT_GT(first, 20u) << "set up when connected";
  const auto same = reports_for(Light::pattern);
  const auto other = reports_for(Light::plain);
  EXPECT_LE(same, 6u) << "start, over, two states";
  EXPECT_LE(other, same + 11u) << "table, validate";
  const auto flashes = bench_.device().flashes();
  ASSERT_EQ(flashes.size(), 3u);
  EXPECT_FALSE(flashes[1].white);
  EXPECT_TRUE(flashes[2].white);
}

TEST_F(LightCrafterTest, AfterAFaultItIsSetUpAnew) {
  expect_fires();
  bench_.device().set_hardware_status(0x05);
  ASSERT_FALSE(fire());
  bench_.device().set_hardware_status(0x01);
  EXPECT_GT(reports_for(Light::pattern), 20u);
}

TEST_F(LightCrafterTest, AFaultItReportsIsAnAlarmInWords) {
  expect_fires();
  bench_.device().set_hardware_status(0x05);
  const auto fired = fire();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(fired.error().message, HasSubstr("reset controller"));
  bench_.device().set_hardware_status(0x01);
  expect_fires();
}

TEST_F(LightCrafterTest, SilenceIsATimeoutAndTheNextFireBeginsAnew) {
  expect_fires();
  bench_.device().inject(Fault::silent, 1);
  const auto fired = fire();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::timeout) << fired.error().message;
  expect_fires();
}

/// The device may have started, and only its reply was lost.
TEST_F(LightCrafterTest, AStartWhoseReplyIsLostIsMadeDark) {
  expect_fires();
  const auto before = bench_.device().flashes().size();
  bench_.device().inject(Fault::silent, 1);
  ASSERT_FALSE(fire());
  ASSERT_EQ(bench_.device().flashes().size(), before + 1) << "it did start";
  EXPECT_FALSE(bench_.device().lit());
  expect_fires();
}

TEST_F(LightCrafterTest, ARefusedCommandIsAProtocolErrorThatNamesIt) {
  bench_.device().inject(Fault::refuse, 1);
  const auto fired = fire();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::protocol);
  EXPECT_THAT(fired.error().message, HasSubstr("0205"));
  expect_fires();
}

TEST_F(LightCrafterTest, AReplyToAnEarlierRequestIsPassedOver) {
  expect_fires();
  bench_.device().inject(Fault::earlier_reply, 3);
  expect_fires();
}

TEST_F(LightCrafterTest, AReplyLongerThanAnyIsAProtocolError) {
  expect_fires();
  bench_.device().inject(Fault::endless_reply, 1);
  const auto fired = fire();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::protocol);
}

TEST_F(LightCrafterTest, OneThatComesBackIsSetUpAgain) {
  expect_fires();
  bench_.plug(false);
  const auto gone = fire();
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, ErrorCode::io);
  const auto still_gone = fire();
  ASSERT_FALSE(still_gone);
  EXPECT_EQ(still_gone.error().code, ErrorCode::not_found);
  bench_.device().power_cycle();
  bench_.plug(true);
  expect_fires();
}

TEST(LightCrafterTriggerIn, WaitsForTheEdgeAtItsInput) {
  LightCrafterBench bench([](auto& options) { options.trigger_in = dlpc350::LutEntry::Trigger::rising; });
  const auto unfired = bench.projector().fire(Light::pattern, Deadline::after(bench.clock(), milliseconds(100)));
  ASSERT_FALSE(unfired);
  EXPECT_EQ(unfired.error().code, ErrorCode::timeout);
  EXPECT_THAT(unfired.error().message, HasSubstr("trigger input"));
  EXPECT_TRUE(bench.seen().empty());
  std::jthread hand([&](const std::stop_token& stop) {
    while (!stop.stop_requested() && bench.seen().empty()) {
      bench.device().trigger_in();
      bench.clock().sleep_for(milliseconds(1));
    }
  });
  const auto fired = bench.projector().fire(Light::pattern, Deadline::after(bench.clock(), std::chrono::seconds(2)));
  EXPECT_TRUE(fired) << fired.error().message;
  EXPECT_EQ(bench.seen().size(), 1u);
}

TEST(LightCrafterOptionsCheck, WhatItCannotDoIsOutOfRange) {
  RealClock clock;
  const auto code = [&](const LightCrafterBench::Change& change) {
    LightCrafterOptions options;
    change(options);
    const auto created = LightCrafterProjector::create(options, {}, clock);
    return created ? ErrorCode::internal : created.error().code;
  };
  EXPECT_EQ(code([](auto& o) { o.image = 64; }), ErrorCode::out_of_range);
  EXPECT_EQ(code([](auto& o) { o.pattern = 24; }), ErrorCode::out_of_range);
  EXPECT_EQ(code([](auto& o) { o.depth = 0; }), ErrorCode::out_of_range);
  EXPECT_EQ(code([](auto& o) { o.exposure = std::chrono::microseconds(100); }), ErrorCode::out_of_range);
  EXPECT_EQ(code([](auto& o) { o.trigger_out_delay = std::chrono::microseconds(3); }), ErrorCode::out_of_range);
  EXPECT_EQ(code([](auto& o) { o.trigger_in_delay = std::chrono::nanoseconds(-1); }), ErrorCode::out_of_range);
}

TEST(LightCrafterUsb, AMachineWithoutOneSaysSo) {
  RealClock clock;
  const auto opened = dlpc350::usb_transport("", clock)();
  ASSERT_FALSE(opened);
  EXPECT_TRUE(opened.error().code == ErrorCode::not_found || opened.error().code == ErrorCode::io);
  EXPECT_THAT(opened.error().message, HasSubstr("LightCrafter"));
}

}  // namespace
}  // namespace scanrig
