#include "drivers/panel/modbus_io_panel.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include "sim/wire/modbus_io.h"

namespace scanrig {
namespace {

using sim::wire::WireFault;
using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr std::size_t kStart = 3, kStop = 4, kEstop = 7, kGuard = 9;
constexpr std::size_t kRed = 2, kGreen = 3;

/// The shipped driver against the far end of the wire.
class ModbusIoPanelTest : public testing::Test {
 protected:
  RealClock clock_;
  sim::wire::ModbusIoModule module_{16, 8};
  const std::string link_ = testing::TempDir() + "io" + std::to_string(::getpid());
  std::unique_ptr<sim::wire::ModbusServer> server_;
  std::unique_ptr<ModbusIoPanel> panel_;

  void SetUp() override {
    module_.set(kEstop, true);  // normally closed
    module_.set(kStop, true);   // wired normally closed too, active low
    auto server = sim::wire::ModbusServer::start(link_, 5, module_, clock_);
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
    open();
  }
  void open(std::uint16_t green = kGreen) {
    panel_ = std::make_unique<ModbusIoPanel>(
        ModbusIoPanelOptions{.line = {.device = link_, .unit_id = 5, .reply_timeout = milliseconds(30)},
                             .inputs = {{&PanelInputs::start, {kStart}},
                                        {&PanelInputs::stop, {kStop, true}},
                                        {&PanelInputs::estop_ok, {kEstop}},
                                        {&PanelInputs::guard_closed, {kGuard, true}}},
                             .outputs = {{&PanelOutputs::red, {kRed}}, {&PanelOutputs::green, {green}}},
                             .poll = milliseconds(10)},
        clock_);
  }
  Deadline within(int ms) { return Deadline::after(clock_, milliseconds(ms)); }
  PanelInputs wait(const PanelInputs& known, int ms) {
    const auto inputs = panel_->wait_change(known, within(ms));
    EXPECT_TRUE(inputs) << inputs.error().message;
    return inputs.value_or(PanelInputs{});
  }
  ErrorCode code_of_wait() {
    const auto inputs = panel_->wait_change({}, within(50));
    return inputs ? ErrorCode::internal : inputs.error().code;
  }
};

TEST_F(ModbusIoPanelTest, AtRestNothingIsPressed) { EXPECT_EQ(wait({}, 30), PanelInputs{}); }

TEST_F(ModbusIoPanelTest, PressesAreDebouncedAndHaveAMinimum) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  const auto at = clock_.now();
  module_.set(kStart, true);
  EXPECT_TRUE(wait({}, 1000).start);
  EXPECT_GE(clock_.now() - at, PanelDebounce::kMinimumPress - milliseconds(1));
  module_.set(kStart, false);
  EXPECT_FALSE(wait({.start = true}, 1000).start);
  module_.set(kStart, true);
  EXPECT_EQ(wait({}, 70), PanelInputs{});
  module_.set(kStart, false);
  EXPECT_EQ(wait({}, 150), PanelInputs{});
}

TEST_F(ModbusIoPanelTest, OpenedSafetyContactsCountAtOnce) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  module_.set(kEstop, false);
  EXPECT_FALSE(wait({}, 45).estop_ok);
  module_.set(kGuard, true);
  EXPECT_FALSE(wait({.estop_ok = false}, 45).guard_closed);
}

TEST_F(ModbusIoPanelTest, ABrokenWireOfANormallyClosedStopIsAPress) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  module_.set(kStop, false);
  EXPECT_TRUE(wait({}, 1000).stop);
}

TEST_F(ModbusIoPanelTest, AButtonStuckAtTheBeginningIsNamedUntilItIsReleased) {
  module_.set(kStart, true);
  for (int i = 0; i < 3; ++i) {
    const auto stuck = panel_->wait_change({}, within(10));
    ASSERT_FALSE(stuck);
    EXPECT_EQ(stuck.error().code, ErrorCode::device_alarm);
    EXPECT_THAT(stuck.error().message, HasSubstr("Start"));
  }
  module_.set(kStart, false);
  while (!panel_->wait_change({}, within(10))) {
  }
  EXPECT_EQ(wait({}, 10), PanelInputs{});
}

TEST_F(ModbusIoPanelTest, LampsShowAndOthersCoilsAreLeftAlone) {
  ASSERT_TRUE(module_.write_coils(0, {true}) == 0);
  ASSERT_TRUE(panel_->show({.red = true}, within(500)));
  EXPECT_TRUE(module_.coil(kRed));
  EXPECT_FALSE(module_.coil(kGreen));
  ASSERT_TRUE(panel_->show({.green = true}, within(500)));
  EXPECT_FALSE(module_.coil(kRed));
  EXPECT_TRUE(module_.coil(kGreen));
  EXPECT_TRUE(module_.coil(0));
}

TEST_F(ModbusIoPanelTest, CoilsWithOthersBetweenThemAreSetOneByOne) {
  open(6);
  ASSERT_EQ(module_.write_coils(4, {true}), 0);
  ASSERT_TRUE(panel_->show({.red = true, .green = true}, within(500)));
  EXPECT_TRUE(module_.coil(kRed) && module_.coil(4) && module_.coil(6));
  ASSERT_TRUE(panel_->show({.red = true}, within(500)));
  EXPECT_TRUE(module_.coil(kRed) && module_.coil(4) && !module_.coil(6));
}

TEST_F(ModbusIoPanelTest, OneMissedAnswerIsRepeatedAndCounted) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  for (const auto kind : {WireFault::Kind::request_lost, WireFault::Kind::wrong_crc, WireFault::Kind::cut_short}) {
    server_->inject({kind, 1, std::uint8_t{2}});
    EXPECT_EQ(wait({}, 60), PanelInputs{});
  }
  EXPECT_EQ(panel_->statistics().retries, 3u);
}

TEST_F(ModbusIoPanelTest, AModuleThatCannotBeReadIsAnErrorByItsName) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  const std::pair<WireFault, ErrorCode> faults[] = {
      {{WireFault::Kind::request_lost}, ErrorCode::timeout},
      {{WireFault::Kind::reply_lost}, ErrorCode::timeout},
      {{.kind = WireFault::Kind::late, .delay = milliseconds(45)}, ErrorCode::timeout},
      {{WireFault::Kind::wrong_crc}, ErrorCode::protocol},
      {{WireFault::Kind::cut_short}, ErrorCode::timeout},
      {{WireFault::Kind::refuse}, ErrorCode::protocol}};
  for (const auto& [fault, code] : faults) {
    server_->inject(fault);
    const auto begun = clock_.now();
    EXPECT_EQ(code_of_wait(), code) << static_cast<int>(fault.kind);
    EXPECT_LT(clock_.now() - begun, milliseconds(600));
    server_->clear_faults();
    while (!panel_->wait_change({}, within(10))) {
    }
    EXPECT_EQ(wait({}, 10), PanelInputs{});
  }
}

TEST_F(ModbusIoPanelTest, TheAnswerOfAnEarlierQuestionIsNeverBelieved) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  server_->inject({WireFault::Kind::earlier_reply});
  module_.set(kEstop, false);
  const auto inputs = panel_->wait_change({}, within(200));
  ASSERT_FALSE(inputs) << "estop_ok = " << inputs->estop_ok;
  EXPECT_EQ(inputs.error().code, ErrorCode::protocol);
}

TEST_F(ModbusIoPanelTest, AnUnpluggedModuleIsBackWhenItIsPluggedInAgain) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  server_->vanish();
  EXPECT_EQ(code_of_wait(), ErrorCode::io);
  EXPECT_EQ(panel_->show({}, within(100)).error().code, ErrorCode::io);
  ASSERT_TRUE(server_->come_back());
  EXPECT_EQ(wait({}, 200), PanelInputs{});
  EXPECT_TRUE(panel_->show({.green = true}, within(500)));
}

TEST_F(ModbusIoPanelTest, AModuleThatWasSwitchedOffAndOnIsNoticedByItsDarkLamps) {
  ASSERT_TRUE(panel_->show({.green = true}, within(500)));
  EXPECT_EQ(wait({}, 30), PanelInputs{});
  module_.power_cycle();
  const auto inputs = panel_->wait_change({}, within(200));
  ASSERT_FALSE(inputs);
  EXPECT_EQ(inputs.error().code, ErrorCode::protocol);
  EXPECT_THAT(inputs.error().message, HasSubstr("coil 3"));
  ASSERT_TRUE(panel_->show({.green = true}, within(500)));
  EXPECT_EQ(wait({}, 30), PanelInputs{});
}

TEST_F(ModbusIoPanelTest, APressThatBeganWhileNobodyCouldReadIsNoPress) {
  EXPECT_EQ(wait({}, 10), PanelInputs{});
  server_->inject({WireFault::Kind::request_lost});
  EXPECT_EQ(code_of_wait(), ErrorCode::timeout);
  module_.set(kStart, true);
  server_->clear_faults();
  EXPECT_EQ(code_of_wait(), ErrorCode::device_alarm);
}

TEST_F(ModbusIoPanelTest, AModuleWithoutCoilsMayRefuseThem) {
  sim::wire::ModbusIoModule inputs_only(16, 0);
  inputs_only.set(kEstop, true);
  server_.reset();
  auto server = sim::wire::ModbusServer::start(link_, 5, inputs_only, clock_);
  ASSERT_TRUE(server);
  ModbusIoPanel panel({.line = {.device = link_, .unit_id = 5, .reply_timeout = milliseconds(30)},
                       .inputs = {{&PanelInputs::estop_ok, {kEstop}}}},
                      clock_);
  EXPECT_EQ(panel.wait_change({}, within(50)), PanelInputs{});
}

}  // namespace
}  // namespace scanrig
