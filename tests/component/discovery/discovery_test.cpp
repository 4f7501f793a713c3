#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "drivers/discovery/panel_wiring.h"
#include "drivers/discovery/serial_devices.h"
#include "sim/wire/gpio_socket.h"
#include "sim/wire/modbus_io.h"
#include "tests/component/turntable/grbl_bench.h"
#include "tests/component/turntable/modbus_bench.h"

namespace scanrig::discovery {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;
namespace fs = std::filesystem;

class Discovery : public testing::Test {
 protected:
  RealClock clock_;
  const std::map<std::string, DriveProfile> profiles_{{"leadshine-rs", kLeadshine.read()},
                                                      {"oriental-az", kOriental.read()}};
  const std::string link_ = testing::TempDir() + "discovery" + std::to_string(::getpid());

  std::optional<SerialDevice> find(const std::string& device) { return find_serial_device(device, profiles_, clock_); }
};

TEST_F(Discovery, ADriveIsToldByTheRegistersOfItsProfile) {
  for (const auto& kind : {kLeadshine, kOriental}) {
    ModbusBench bench(kind);
    const auto found = find(bench.device());
    ASSERT_TRUE(found) << kind.profile;
    EXPECT_EQ(found->kind, SerialDevice::Kind::drive);
    EXPECT_THAT(found->profiles, ElementsAre(std::string(kind.profile)));
    EXPECT_EQ(found->line.device, bench.device());
    EXPECT_EQ(found->line.unit_id, 1);
  }
}

TEST_F(Discovery, ADriveIsFoundAtAnotherUnitId) {
  sim::wire::LeadshineDrive drive({}, clock_);
  const auto server = sim::wire::ModbusServer::start(link_, 7, drive, clock_);
  ASSERT_TRUE(server) << server.error().message;
  const auto found = find(link_);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->line.unit_id, 7);
  EXPECT_THAT(found->profiles, ElementsAre("leadshine-rs"));
}

TEST_F(Discovery, AskingADriveMovesNothing) {
  ModbusBench bench(kLeadshine);
  bool written = false;
  bench.on_request([&](const sim::wire::ModbusRequest& request) { written |= request.function > 4; });
  ASSERT_TRUE(find(bench.device()));
  EXPECT_FALSE(written);
}

TEST_F(Discovery, AGrblControllerSaysWhatItIs) {
  GrblBench bench;
  const auto found = find(bench.device());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->kind, SerialDevice::Kind::grbl);
  EXPECT_THAT(found->answer, testing::StartsWith("<"));
}

TEST_F(Discovery, NothingIsFoundWhereNothingResponds) {
  EXPECT_FALSE(find("/dev/null/no-such-port"));
  ModbusBench bench(kLeadshine);
  bench.server().inject({.kind = sim::wire::WireFault::Kind::request_lost});
  EXPECT_FALSE(find(bench.device()));
}

TEST_F(Discovery, EachAdapterIsListedOnceByTheNameThatStays) {
  const auto dev = fs::path(testing::TempDir()) / ("dev" + std::to_string(::getpid()));
  fs::create_directories(dev / "serial" / "by-id");
  for (const char* port : {"ttyUSB0", "ttyUSB1", "ttyACM0", "ttyS0"}) std::ofstream(dev / port) << "";
  fs::create_symlink("../../ttyUSB1", dev / "serial" / "by-id" / "usb-FTDI_1234");
  EXPECT_THAT(serial_ports(dev), ElementsAre((dev / "serial/by-id/usb-FTDI_1234").string(), (dev / "ttyUSB0").string(),
                                             (dev / "ttyACM0").string()));
  fs::remove_all(dev);
  EXPECT_THAT(serial_ports(dev), IsEmpty());
}

class Module : public Discovery {
 protected:
  sim::wire::ModbusIoModule module_{7, 8};
  std::unique_ptr<sim::wire::ModbusServer> server_;

  void SetUp() override {
    module_.set(3, true);
    auto server = sim::wire::ModbusServer::start(link_, 2, module_, clock_);
    ASSERT_TRUE(server) << server.error().message;
    server_ = *std::move(server);
  }
  IoModuleProbe probe() { return {{.device = link_, .unit_id = 2, .reply_timeout = milliseconds(40)}, clock_}; }
  Deadline soon() { return Deadline::after(clock_, milliseconds(300)); }
};

TEST_F(Module, IsToldFromADriveByItsInputs) {
  const auto found = find(link_);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->kind, SerialDevice::Kind::io_module);
  EXPECT_EQ(found->line.unit_id, 2);
}

TEST_F(Module, SaysHowManyChannelsItHas) {
  auto probing = probe();
  ASSERT_TRUE(probing.begin());
  EXPECT_EQ(probing.inputs(), 7);
  EXPECT_EQ(probing.outputs(), 8);
}

TEST_F(Module, TheInputThatChangesIsTheOneThatWasPressed) {
  auto probing = probe();
  ASSERT_TRUE(probing.begin());
  const auto none = probing.wait_for_change(soon());
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  module_.set(5, true);
  const auto pressed = probing.wait_for_change(soon());
  ASSERT_TRUE(pressed && *pressed);
  EXPECT_EQ((*pressed)->channel, 5);
  EXPECT_TRUE((*pressed)->is_set);
  EXPECT_FALSE(probing.wait_for_rest(soon()).value());
  module_.set(3, false);
  EXPECT_FALSE(*probing.wait_for_change(soon())) << "two at once name neither";
  module_.set(5, false);
  const auto opened = probing.wait_for_change(soon());
  ASSERT_TRUE(opened && *opened);
  EXPECT_EQ((*opened)->channel, 3);
  EXPECT_FALSE((*opened)->is_set);
  module_.set(3, true);
  EXPECT_TRUE(probing.wait_for_rest(soon()).value());
}

TEST_F(Module, AnOutputIsSwitchedByItsChannel) {
  auto probing = probe();
  ASSERT_TRUE(probing.begin());
  ASSERT_TRUE(probing.set_output(6, true));
  EXPECT_TRUE(module_.coil(6));
  ASSERT_TRUE(probing.set_output(6, false));
  EXPECT_FALSE(module_.coil(6));
}

TEST_F(Module, AModuleThatIsGoneIsAnError) {
  auto probing = probe();
  ASSERT_TRUE(probing.begin());
  server_->inject({.kind = sim::wire::WireFault::Kind::request_lost});
  EXPECT_FALSE(probing.wait_for_change(Deadline::after(clock_, std::chrono::seconds(20))));
}

TEST_F(Discovery, LinesThatAreThereAreNamed) {
  const auto socket = link_ + ".gpio";
  const auto far_end = sim::wire::GpioSocket::start(socket, {{"START", true}, {"LAMP_RED", false}}, clock_);
  ASSERT_TRUE(far_end) << far_end.error().message;
  const auto lines = gpio::socket_lines(socket, clock_);
  EXPECT_THAT(readable_lines(*lines, {"START", "STOP", "LAMP_RED"}), ElementsAre("START", "LAMP_RED"));
  EXPECT_THAT((*far_end)->edges(), IsEmpty()) << "asking switches nothing";
}

}  // namespace
}  // namespace scanrig::discovery
