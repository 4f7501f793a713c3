#include "sim/apps/wire_rig.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "config/gpio_options.h"
#include "config/rig_config.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/apps/rig_control.h"
#include "sim/apps/scanrig_sim_ctl.h"
#include "sim/wire/control_socket.h"
#include "tests/own_folder.h"

namespace scanrig::sim {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

/// The simulated rig in this process, accessed through its socket.
class WireRigTest : public testing::Test {
 protected:
  void SetUp() override { start("leadshine-rs", "gpio"); }
  void TearDown() override {
    socket_.reset();
    rig_.reset();
    std::filesystem::remove_all(folder_);
  }
  void start(const std::string& drive, const std::string& panel) {
    socket_.reset();
    rig_.reset();
    std::filesystem::remove_all(folder_);
    WireRigOptions options;
    options.toml.folder = folder_;
    options.toml.drive = drive;
    options.toml.panel = panel;
    options.axis.start_deg = 20;
    options.toml.speed_deg_s = 180;
    options.toml.acceleration_deg_s2 = 2000;
    auto rig = WireRig::start(options, clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = std::move(*rig);
    control_ = std::make_unique<RigControl>(*rig_, clock_);
    auto socket = wire::ControlSocket::start(folder_ / "control.sock",
                                             [this](const std::string& line) { return control_->reply_to(line); });
    ASSERT_TRUE(socket) << socket.error().message;
    socket_ = std::move(*socket);
  }
  json send(const json& request) {
    const auto reply = wire::send_to_control_socket(folder_ / "control.sock", request.dump());
    return reply ? json::parse(*reply) : json{{"error", reply.error().message}};
  }
  Result<config::RigConfig> config() const {
    return config::read_rig_config(folder_ / "rig.toml", {}, config::Cameras::or_simulated);
  }
  std::unique_ptr<ModbusTurntable> driver() {
    const auto rig = config();
    EXPECT_TRUE(rig) << rig.error().message;
    return ModbusTurntable::create(rig->turntable.modbus, clock_).value();
  }
  Deadline within(Clock::Duration time) { return Deadline::after(clock_, time); }

  RealClock clock_;
  const std::filesystem::path folder_ = own_folder("rig_");
  std::unique_ptr<WireRig> rig_;
  std::unique_ptr<RigControl> control_;
  std::unique_ptr<wire::ControlSocket> socket_;
};

TEST_F(WireRigTest, WritesAConfigurationThatTheDaemonReadsForEitherPanel) {
  for (const char* panel : {"gpio", "modbus-io"}) {
    start("leadshine-rs", panel);
    const auto rig = config();
    ASSERT_TRUE(rig) << rig.error().message;
    EXPECT_EQ(rig->turntable.modbus.line.device, (folder_ / "turntable").string());
    EXPECT_EQ(rig->stereo_camera.truth, folder_ / "control.sock");
  }
}

TEST_F(WireRigTest, ReportsTheTruePositionOfTheTable) {
  const auto table = driver();
  ASSERT_TRUE(table->home(within(seconds(20))));
  const double home = send({{"get", "truth"}})["angle_deg"];
  ASSERT_TRUE(table->rotate_to({90}, within(seconds(10))));
  const auto truth = send({{"get", "truth"}});
  EXPECT_NEAR(truth["angle_deg"].get<double>() - home, 90, 0.5);
  EXPECT_EQ(truth["stopped"], true);
  EXPECT_EQ(truth["speed_deg_s"], 0.0);
  EXPECT_EQ(truth["projector_on"], false);
}

TEST_F(WireRigTest, ListsReceivedAndSentFramesWithTheirTimes) {
  const auto table = driver();
  ASSERT_TRUE(table->status(within(seconds(2))));
  const auto all = send({{"get", "frames"}});
  ASSERT_GE(all["frames"].size(), 2u);
  EXPECT_EQ(all["frames"][0]["bytes"], "01 03 10 03 00 01 70 CA");
  EXPECT_EQ(all["frames"][0]["from_master"], true);
  EXPECT_EQ(all["frames"][1]["from_master"], false);
  EXPECT_LE(all["frames"][0]["at_ns"], all["frames"][1]["at_ns"]);
  EXPECT_TRUE(send({{"get", "frames"}, {"since", all["next"]}})["frames"].empty());
}

TEST_F(WireRigTest, FaultsComeAndGoWhileItRuns) {
  const auto table = driver();
  EXPECT_EQ(send({{"set", {{"fault", "silent"}}}})["ok"], true);
  EXPECT_EQ(table->status(within(milliseconds(500))).error().code, ErrorCode::timeout);
  send({{"set", {{"fault", "refuse"}}}});
  EXPECT_EQ(table->status(within(milliseconds(1000))).error().code, ErrorCode::protocol);
  send({{"set", {{"fault", "none"}}}});
  EXPECT_TRUE(table->status(within(seconds(1))));
  send({{"set", {{"unplugged", true}}}});
  EXPECT_EQ(table->status(within(milliseconds(500))).error().code, ErrorCode::io);
  send({{"set", {{"unplugged", false}}}});
  EXPECT_TRUE(table->status(within(seconds(1))));
  send({{"set", {{"alarm", 0x20}}}});
  EXPECT_THAT(table->status(within(seconds(1)))->alarm, HasSubstr("following error"));
}

TEST_F(WireRigTest, ReceivesOnlyRequestsWithItsParity) {
  const auto rig = config();
  ASSERT_TRUE(rig);
  auto options = rig->turntable.modbus;
  send({{"set", {{"line", {{"parity", "odd"}}}}}});
  const auto received = [&](modbus::Parity parity) {
    options.line.parity = parity;
    auto table = ModbusTurntable::create(options, clock_).value();
    return table->status(within(seconds(1))).has_value();
  };
  EXPECT_FALSE(received(modbus::Parity::none));
  EXPECT_FALSE(received(modbus::Parity::even));
  EXPECT_TRUE(received(modbus::Parity::odd));
}

TEST_F(WireRigTest, APressedEmergencyStopTakesThePowerFromTheDrive) {
  const auto table = driver();
  ASSERT_TRUE(table->home(within(seconds(20))));
  EXPECT_EQ(send({{"press", "estop"}})["ok"], true);
  EXPECT_EQ(send({{"get", "truth"}})["powered"], false);
  EXPECT_EQ(table->status(within(milliseconds(500))).error().code, ErrorCode::timeout);
  send({{"release", "estop"}});
  const auto status = table->status(within(seconds(1)));
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_FALSE(status->homed);
}

TEST_F(WireRigTest, ContactsAreBridgedBrokenAndMended) {
  const auto lines = gpio::socket_lines(folder_ / "gpio.sock", clock_);
  const auto estop_ok = [&] {
    const auto panel = GpioPanel::open(config::gpio_panel_options(*config()), *lines, clock_);
    return panel.value()->wait_change({}, within(milliseconds(100)))->estop_ok;
  };
  const auto wire = [&](const char* how) { send({{"set", {{"wiring", {{"estop", how}}}}}}); };
  EXPECT_TRUE(estop_ok());
  send({{"press", "estop"}});
  EXPECT_FALSE(estop_ok());
  wire("bridged");
  EXPECT_TRUE(estop_ok());
  send({{"release", "estop"}});
  wire("broken");
  EXPECT_FALSE(estop_ok());
  wire("wired");
  EXPECT_TRUE(estop_ok());
  const auto changes = send({{"get", "changes"}})["changes"];
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[0]["name"], "estop");
  EXPECT_EQ(changes[0]["on"], true);
}

TEST_F(WireRigTest, ThePanelsModuleHasFaultsOfItsOwn) {
  EXPECT_TRUE(send({{"set", {{"panel_fault", "silent"}}}}).contains("error"));  // on GPIO
  start("leadshine-rs", "modbus-io");
  ModbusIoPanel panel(config::modbus_io_panel_options(*config()), clock_);
  EXPECT_TRUE(panel.wait_change({}, within(milliseconds(300))));
  EXPECT_FALSE(send({{"get", "panel_frames"}})["frames"].empty());
  send({{"set", {{"panel_fault", "silent"}}}});
  EXPECT_FALSE(panel.wait_change({}, within(milliseconds(1000))));
  send({{"set", {{"panel_fault", "none"}, {"panel_unplugged", true}}}});
  EXPECT_FALSE(panel.wait_change({}, within(milliseconds(1000))));
  send({{"set", {{"panel_unplugged", false}}}});
  EXPECT_TRUE(panel.wait_change({}, within(milliseconds(1000))));
}

TEST_F(WireRigTest, PhysicsChangesWhileItRuns) {
  const auto table = driver();
  ASSERT_TRUE(table->home(within(seconds(20))));
  const auto seen = [&] { return send({{"get", "truth"}})["angle_deg"].get<double>(); };
  EXPECT_NEAR(seen(), 0.3, 0.01);  // home is found turning back: the table lags behind by the play
  send({{"set", {{"physics", {{"backlash_deg", 2.0}}}}}});
  ASSERT_TRUE(table->home(within(seconds(20))));
  EXPECT_NEAR(seen(), 2.0, 0.01);
  ASSERT_TRUE(table->rotate_to({90}, within(seconds(10))));
  EXPECT_NEAR(seen(), 90, 0.01);
}

TEST_F(WireRigTest, SeveralClientsAreServedAtOnce) {
  std::vector<std::jthread> clients;
  std::atomic<int> replies = 0;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      for (int n = 0; n < 25; ++n) replies += send({{"get", "truth"}}).contains("angle_deg");
    });
  }
  clients.clear();
  EXPECT_EQ(replies, 100);
}

TEST_F(WireRigTest, AnInvalidRequestIsNamed) {
  for (const json& request : {json{{"get", "weather"}}, json{{"set", {{"colour", "red"}}}}, json{{"press", "doorbell"}},
                              json{{"set", {{"fault", "bad luck"}}}}, json{{"dance", true}}, json::array()}) {
    EXPECT_TRUE(send(request).contains("error")) << request;
  }
  const auto garbled = wire::send_to_control_socket(folder_ / "control.sock", "{not json");
  ASSERT_TRUE(garbled);
  EXPECT_THAT(*garbled, HasSubstr("error"));
  EXPECT_EQ(wire::send_to_control_socket(folder_ / "absent.sock", "{}").error().code, ErrorCode::io);
}

TEST_F(WireRigTest, ADriveOrPanelThatIsNotSimulatedIsRefused) {
  WireRigOptions options;
  options.toml = {.folder = folder_, .drive = "abacus", .panel = "gpio"};
  EXPECT_EQ(WireRig::start(options, clock_).error().code, ErrorCode::unsupported);
  options.toml = {.folder = folder_, .drive = "leadshine-rs", .panel = "abacus"};
  EXPECT_EQ(WireRig::start(options, clock_).error().code, ErrorCode::unsupported);
}

TEST(ControlWords, BecomeRequests) {
  EXPECT_EQ(json::parse(*control_request({"get", "frames", "12"})), (json{{"get", "frames"}, {"since", 12}}));
  EXPECT_EQ(json::parse(*control_request({"set", "fault=silent", "blocked=true"})),
            (json{{"set", {{"fault", "silent"}, {"blocked", true}}}}));
  EXPECT_EQ(json::parse(*control_request({"press", "start"})), (json{{"press", "start"}}));
  for (const auto& words : std::vector<std::vector<std::string>>{{}, {"get"}, {"set", "fault"}, {"shout", "loud"}}) {
    EXPECT_EQ(control_request(words).error().code, ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace scanrig::sim
