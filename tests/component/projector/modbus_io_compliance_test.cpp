#include <gmock/gmock.h>
#include <unistd.h>

#include "drivers/panel/modbus_io_panel.h"
#include "drivers/projector/modbus_io_projector.h"
#include "sim/wire/modbus_io.h"
#include "tests/component/projector/projector_compliance.h"

namespace scanrig {
namespace {

using sim::wire::WireFault;
using std::chrono::milliseconds;

constexpr std::uint16_t kDots = 5, kPlain = 6;
constexpr milliseconds kPulse{30};

/// An I/O module behind a pseudo-terminal that also has a button and a lamp of the panel.
class Module {
 public:
  Module() { plug(true); }
  ~Module() { end(); }
  /// Ends the server and the onlooker.
  void end() {
    server.reset();
    if (onlooker_.joinable()) onlooker_.join();
  }

  modbus::ClientOptions line() const { return {.device = link_, .unit_id = 5, .reply_timeout = milliseconds(50)}; }
  ModbusIoProjectorOptions projector() const {
    return {.line = line(), .pattern_coil = kDots, .plain_coil = kPlain, .pulse = kPulse};
  }
  void plug(bool in) {
    if (!in) return server->vanish();
    if (server) {
      ASSERT_TRUE(server->come_back());
    } else {
      server = sim::wire::ModbusServer::start(link_, 5, io, clock).value();
    }
    server->on_request([this](const sim::wire::ModbusRequest& request) { note(request); });
  }
  std::vector<ProjectorBench::Flash> flashes() {
    const std::scoped_lock lock(mutex_);
    return flashes_;
  }
  void when_lit(std::function<void()> act) {
    const std::scoped_lock lock(mutex_);
    act_ = std::move(act);
  }
  [[nodiscard]] bool is_lit() const { return io.coil(kDots) || io.coil(kPlain); }

  RealClock clock;
  sim::wire::ModbusIoModule io{8, 8};
  std::unique_ptr<sim::wire::ModbusServer> server;

 private:
  void note(const sim::wire::ModbusRequest& request) {
    if (request.function != 5 || !request.bits.front()) return;
    if (request.address != kDots && request.address != kPlain) return;
    const std::scoped_lock lock(mutex_);
    flashes_.push_back({request.address == kDots ? Light::pattern : Light::plain, clock.now()});
    if (act_) onlooker_ = std::jthread(std::exchange(act_, {}));
  }

  const std::string link_ = testing::TempDir() + "io-light" + std::to_string(::getpid()) + "-" +
                            std::to_string(reinterpret_cast<std::uintptr_t>(this));
  std::mutex mutex_;
  std::vector<ProjectorBench::Flash> flashes_;
  std::function<void()> act_;
  std::jthread onlooker_;
};

class ModbusIoProjectorBench final : public ProjectorBench {
 public:
  ~ModbusIoProjectorBench() override { module_.end(); }
  Projector& projector() override { return projector_; }
  Clock& clock() override { return module_.clock; }
  std::vector<Flash> seen() override { return module_.flashes(); }
  bool seen_lit() override { return module_.is_lit(); }
  void when_lit(std::function<void()> act) override { module_.when_lit(std::move(act)); }
  Clock::Duration exposure() const override { return kPulse - milliseconds(1); }
  void plug(bool in) override { module_.plug(in); }

 private:
  Module module_;
  ModbusIoProjector projector_{module_.projector(), module_.clock};
};

std::unique_ptr<ProjectorBench> make_bench() { return std::make_unique<ModbusIoProjectorBench>(); }

INSTANTIATE_TEST_SUITE_P(ModbusIo, ProjectorCompliance, testing::Values(&make_bench));

class ModbusIoProjectorTest : public testing::Test {
 protected:
  Deadline within(int ms) { return Deadline::after(module_.clock, milliseconds(ms)); }

  Module module_;
};

TEST_F(ModbusIoProjectorTest, PlainLightWithoutACoilIsUnsupported) {
  auto options = module_.projector();
  options.plain_coil.reset();
  ModbusIoProjector projector(options, module_.clock);
  const auto fired = projector.fire(Light::plain, within(2000));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::unsupported);
  EXPECT_TRUE(projector.turn_off(within(2000)));
}

TEST_F(ModbusIoProjectorTest, AnActiveLowCoilRestsOn) {
  auto options = module_.projector();
  options.active_low = true;
  ModbusIoProjector projector(options, module_.clock);
  ASSERT_TRUE(projector.turn_off(within(2000)));
  EXPECT_TRUE(module_.io.coil(kDots) && module_.io.coil(kPlain));
  ASSERT_TRUE(projector.fire(Light::pattern, within(2000)));
  EXPECT_TRUE(module_.io.coil(kDots));
}

TEST_F(ModbusIoProjectorTest, ALostReplyToSwitchingOffLeavesNoLight) {
  ModbusIoProjector projector(module_.projector(), module_.clock);
  ASSERT_TRUE(projector.turn_off(within(2000)));
  module_.when_lit(
      [this] { module_.server->inject({.kind = WireFault::Kind::request_lost, .count = 1, .function = 5}); });
  const auto fired = projector.fire(Light::pattern, within(2000));
  EXPECT_TRUE(fired) << fired.error().message;
  EXPECT_FALSE(module_.is_lit());
}

TEST_F(ModbusIoProjectorTest, AModuleThatRefusesIsNamedAndItsLightIsInDoubt) {
  ModbusIoProjector projector(module_.projector(), module_.clock);
  module_.server->inject({.kind = WireFault::Kind::refuse});
  const auto dark = projector.turn_off(within(2000));
  ASSERT_FALSE(dark);
  EXPECT_EQ(dark.error().code, ErrorCode::protocol);
  EXPECT_THAT(dark.error().message, testing::HasSubstr("the light may be on"));
}

/// One port has one master: both drivers use it, each whole request on its own.
TEST_F(ModbusIoProjectorTest, SharesItsModuleWithAPanelThatKeepsReading) {
  ModbusIoPanel panel({.line = module_.line(),
                       .inputs = {{&PanelInputs::start, {0}}},
                       .outputs = {{&PanelOutputs::red, {0}}},
                       .poll = milliseconds(5)},
                      module_.clock);
  ModbusIoProjector projector(module_.projector(), module_.clock);
  std::jthread reader([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto inputs = panel.wait_change({}, within(20));
      EXPECT_TRUE(inputs) << inputs.error().message;
    }
  });
  for (int i = 0; i < 10; ++i) {
    const auto fired = projector.fire(i % 2 == 0 ? Light::pattern : Light::plain, within(2000));
    ASSERT_TRUE(fired) << fired.error().message;
    EXPECT_FALSE(module_.is_lit());
  }
  EXPECT_EQ(module_.flashes().size(), 10u);
}

}  // namespace
}  // namespace scanrig
