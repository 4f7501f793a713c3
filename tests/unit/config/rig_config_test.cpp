#include "config/rig_config.h"

#include <gmock/gmock.h>

#include "core/hash.h"
#include "tests/unit/config/rig_file.h"

namespace scanrig::config {
namespace {

using testing::HasSubstr;

class RigConfigTest : public RigFile {};

TEST_F(RigConfigTest, TheShippedExampleIsReadAsItIsWritten) {
  const auto read = read_rig_config(std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/rigs/example.toml");
  ASSERT_TRUE(read) << read.error().message;
  const RigConfig& rig = *read;
  EXPECT_EQ(rig.safety.estop.line, "ESTOP_OK");
  EXPECT_TRUE(rig.safety.estop.active_low);
  EXPECT_EQ(rig.safety.guard.value().line, "GUARD_OK");
  EXPECT_FALSE(rig.safety.remote_start);
  const auto& table = rig.turntable.modbus;
  EXPECT_EQ(table.profile.name, "leadshine-rs");
  EXPECT_EQ(table.line.device, "/dev/scanrig/turntable");
  EXPECT_EQ(table.line.baud, 115200);
  EXPECT_EQ(table.line.parity, modbus::Parity::none);
  EXPECT_EQ(table.line.reply_timeout, std::chrono::milliseconds(60));
  EXPECT_EQ(table.scale.pulses_per_motor_rev, 10000);
  EXPECT_EQ(table.scale.gear_ratio, 90.0);
  EXPECT_TRUE(table.scale.positive_ccw);
  EXPECT_EQ(table.home_mode, "switch");
  EXPECT_EQ(table.speed, DegreesPerSecond{45});
  EXPECT_EQ(table.acceleration, DegreesPerSecond2{90});
  EXPECT_EQ(table.backlash, Degrees{0.5});
  EXPECT_EQ(table.tolerance, Degrees{0.02});
  EXPECT_EQ(table.settle, std::chrono::milliseconds(200));
  EXPECT_EQ(rig.projector.driver, ProjectorConfig::Driver::gpio);
  EXPECT_EQ(rig.projector.pulse, std::chrono::microseconds(15000));
  EXPECT_EQ(rig.stereo_camera.aravis.left.serial, "40012345");
  EXPECT_EQ(rig.stereo_camera.aravis.right.address, "192.168.10.12");
  EXPECT_EQ(rig.stereo_camera.aravis.packet_bytes, 8192);
  EXPECT_EQ(rig.panel.inputs.at("start").line, "START");
  EXPECT_EQ(rig.panel.inputs.at("reset").line, "RESET");
  EXPECT_EQ(rig.panel.outputs.at("lamp_green").line, "LAMP_GREEN");
  EXPECT_EQ(rig.panel.outputs.size(), 8u);
  EXPECT_EQ(rig.projector.plain_line.value().line, "PROJ_PLAIN");
  EXPECT_EQ(rig.stereo_camera.aravis.pixel_format, "BayerRG8");
  EXPECT_EQ(rig.calibration_file, "/var/lib/scanrig/calibration.json");
  EXPECT_EQ(rig.recipes.at("default").views, 8);
  EXPECT_EQ(rig.recipes.at("default").flip_timeout, std::chrono::minutes(30));
  EXPECT_EQ(rig.storage.reserve_gib, 20);
  EXPECT_EQ(rig.reconstruction.voxel_mm, 0.25);
  EXPECT_EQ(rig.api.socket, "/run/scanrig/api.sock");
  EXPECT_FALSE(rig.api.http_port);
}

TEST_F(RigConfigTest, IsNamedByTheTextItWasReadFrom) {
  const auto rig = read_rig_config(std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/rigs/example.toml");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(sha256(rig->text), sha256(shipped("rigs/example.toml")));
}

TEST_F(RigConfigTest, TheDirectionOfRs485IsAKeyOfEachBus) {
  EXPECT_FALSE(read(example_)->turntable.modbus.line.rs485) << "most adapters switch it by themselves";
  const auto rig = read(replaced(example_, "unit_id = 1", "unit_id = 1\nrs485 = { rts = \"low\", after_ms = 2 }"));
  ASSERT_TRUE(rig) << rig.error().message;
  const auto& rs485 = rig->turntable.modbus.line.rs485;
  ASSERT_TRUE(rs485);
  EXPECT_FALSE(rs485->high_while_sending);
  EXPECT_EQ(rs485->before, std::chrono::milliseconds(0));
  EXPECT_EQ(rs485->after, std::chrono::milliseconds(2));
  for (const auto& [key, problem] :
       {std::pair("rs485 = { rts = \"on\" }", "[turntable] rs485.rts: \"on\" is not one of high, low"),
        std::pair("rs485 = { rts = \"high\", before_ms = 101 }",
                  "[turntable] rs485.before_ms: 101 is not between 0 and 100"),
        std::pair("rs485 = true", "[turntable] rs485: must be a table")}) {
    const auto wrong = read(replaced(example_, "unit_id = 1", std::string("unit_id = 1\n") + key));
    ASSERT_FALSE(wrong) << key;
    EXPECT_THAT(wrong.error().message, HasSubstr(problem));
  }
}

TEST_F(RigConfigTest, AGrblTurntableHasItsOwnKeys) {
  std::string text = replaced(example_, "driver = \"modbus\"", "driver = \"grbl\"\naxis = \"A\"");
  for (const char* line :
       {"profile = \"leadshine-rs\"", "parity = \"none\"", "unit_id = 1", "pulses_per_motor_rev = 10000"}) {
    text = replaced(text, line, "");
  }
  const auto rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->turntable.driver, TurntableConfig::Driver::grbl);
  EXPECT_EQ(rig->turntable.grbl.drive.axis, 'A');
  EXPECT_EQ(rig->turntable.device(), "/dev/scanrig/turntable");
  EXPECT_EQ(rig->turntable.motion().speed, DegreesPerSecond{45});
  EXPECT_EQ(rig->turntable.motion().settle, std::chrono::milliseconds(200));
}

TEST_F(RigConfigTest, RulesBetweenKeysAreChecked) {
  expect_problem("pulse_us = 15000", "pulse_us = 11000",
                 "[projector] pulse_us: 11000 is shorter than the longest exposure of 12000 in [stereo_camera]");
  expect_problem("\"40012346\"", "\"40012345\"", "[stereo_camera] right: has the same serial number as left",
                 "right = ");
  expect_problem("unit_id = 1", "unit_id = 32",
                 "[turntable] unit_id: 32 is not between 1 and 31, as leadshine-rs allows");
  expect_problem(
      "speed_deg_s = 45", "speed_deg_s = 300",
      "[turntable] speed_deg_s: 300 deg/s at the table is 4500 rpm at the motor, the drive allows more than 0 "
      "to 3000 rpm");
  expect_problem("tolerance_deg = 0.02", "tolerance_deg = 0.0005",
                 "[turntable] tolerance_deg: 0.0005 is less than 2 pulses of the motor; at least 0.0008 is possible");
  expect_problem("settle_ms = 200", "soft_limits = { min_deg = 10, max_deg = 10 }\nsettle_ms = 200",
                 "[turntable] soft_limits.max_deg: must be more than min_deg", "soft_limits");
  std::string oriental = replaced(example_, "\"leadshine-rs\"", "\"oriental-az\"");
  oriental = replaced(oriental, "mode = \"switch\"", "mode = \"absolute\"");
  EXPECT_TRUE(read(oriental));
  expect_problem_in(oriental, "reply_timeout_ms = 60\n", "reply_timeout_ms = 151\n",
                    "[turntable] reply_timeout_ms: 151 is too long for oriental-az, which stops after 3000 ms without "
                    "a request; at most 150 ms");
  const std::string no_guard = replaced(example_, "guard = { line", "#guard = { line");
  const auto remote = read(replaced(no_guard, "remote_start = false", "remote_start = true"));
  ASSERT_FALSE(remote);
  EXPECT_THAT(remote.error().message, HasSubstr("[safety] remote_start: true needs a guard"));
  const auto guarded = read(replaced(no_guard, "\"on_reset\"", "\"guarded\""));
  ASSERT_FALSE(guarded);
  EXPECT_THAT(guarded.error().message, HasSubstr("[safety] home_after_restart: \"guarded\" needs a guard"));
  EXPECT_TRUE(read(no_guard));
}

TEST_F(RigConfigTest, ARigThatCouldNeverScanIsRefusedWithTheReason) {
  const std::string start = "start = { line = \"START\"", panel = "[panel]\n";
  expect_problem("reset = { line = \"RESET\"", "# reset = {",
                 "[panel] reset: missing: the table is homed, and a fault cleared, by Reset only; name its input",
                 panel);
  expect_problem("lamp_red = { line", "# lamp_red = { line",
                 "[panel] lamp_red: missing: a fault would not be visible at the rig; name the output of the red lamp",
                 panel);
  expect_problem("plain_line = ", "# plain_line = ",
                 "[projector] plain_line: missing: every view needs a plain image; name the output that fires "
                 "it",
                 "[projector]\n");
  expect_problem("\"BayerRG8\"", "\"Mono12\"",
                 "[stereo_camera] pixel_format: Mono12 is grey, and the blue screen needs a colour format, such as "
                 "BayerRG8");
}

TEST_F(RigConfigTest, OneOutputIsNotTwoSignals) {
  expect_problem("\"PROJ_PLAIN\"", "\"PROJ_TRIG\"", "[projector] plain_line: is on the same contact as line",
                 "plain_line = ");
  expect_problem("\"PROJ_PLAIN\"", "\"LAMP_RED\"", "[projector] plain_line: is on the same contact as lamp_red",
                 "plain_line = ");
}

TEST_F(RigConfigTest, LinesHaveANameOrAChipAndAnOffset) {
  std::string text = replaced(example_, "reset = { line = \"RESET\", active = \"low\" }",
                              "reset = { chip = \"gpiochip4\", offset = 21, active = \"low\", bias = \"pull-down\" }");
  text = replaced(text, "lamp_red = { line = \"LAMP_RED\" }", "lamp_red = { chip = \"pinctrl\", offset = 4 }");
  text = replaced(text, "plain_line = \"PROJ_PLAIN\"", "plain_line = { chip = \"gpiochip1\", offset = 3 }");
  const auto rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  const Pin& reset = rig->panel.inputs.at("reset");
  EXPECT_EQ(reset.line, "");
  EXPECT_EQ(reset.chip, "gpiochip4");
  EXPECT_EQ(reset.offset, 21);
  EXPECT_TRUE(reset.active_low);
  EXPECT_EQ(reset.bias, gpio::Bias::pull_down);
  EXPECT_EQ(rig->panel.inputs.at("start").bias, gpio::Bias::as_is);
  EXPECT_EQ(rig->panel.outputs.at("lamp_red").chip, "pinctrl");
  EXPECT_EQ(rig->projector.plain_line.value().chip, "gpiochip1");
  expect_problem_in(text, "offset = 21, ", "", "[panel] reset.offset: missing", "reset = {");
  expect_problem_in(text, "offset = 21", "offset = -1", "[panel] reset.offset: -1 is not between 0 and 4095");
  expect_problem_in(text, "\"pull-down\" }", "\"up\" }",
                    "[panel] reset.bias: \"up\" is not one of pull-up, pull-down, disabled, as-is");
  expect_problem_in(text, "\"pinctrl\", offset = 4", "\"pinctrl\", offset = 4, bias = \"pull-up\"",
                    "[panel] lamp_red.bias: unknown key; known here: active, chip, offset", "lamp_red = {");
  expect_problem_in(text, "chip = \"gpiochip4\", offset", "line = \"RESET\", offset",
                    "[panel] reset.offset: unknown key; known here: active, bias, chip, line", "reset = {");
  expect_problem_in(text, "{ line = \"STOP\", active = \"low\" }", "{ chip = \"gpiochip4\", offset = 21 }",
                    "[panel] stop: is on the same contact as reset");
}

TEST_F(RigConfigTest, TcpNeedsTokensAndIsOnThisMachineUnlessToldOtherwise) {
  const std::string socket = "socket = \"/run/scanrig/api.sock\"\n";
  auto rig = read(replaced(example_, socket, socket + "http_port = 8080\n"));
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[api] http_port: needs tokens"));
  rig = read(replaced(example_, socket, socket + "http_address = \"0.0.0.0\"\n"));
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[api] http_address: needs http_port"));
  rig = read(replaced(example_, socket, socket + "proxy = \"127.0.0.1\"\n"));
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[api] proxy: needs http_port, or \"unix:USER\""));
  rig = read(replaced(example_, socket, socket + "proxy = \"unix:www-data\"\n"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->api.proxy, "unix:www-data");
  rig = read(replaced(example_, socket,
                      socket + "tokens = \"tokens.json\"\nhttp_port = 8080\noperator_group = \"scanners\"\n"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->api.http_port, 8080);
  EXPECT_EQ(rig->api.http_address, "127.0.0.1");
  EXPECT_EQ(rig->api.tokens, folder_ / "tokens.json");
  EXPECT_EQ(rig->api.operator_group, "scanners");
  EXPECT_FALSE(rig->api.engineer_group);
}

TEST_F(RigConfigTest, OtherMachinesReachItThroughTlsUnlessSaidOtherwise) {
  const std::string socket = "socket = \"/run/scanrig/api.sock\"\n";
  const std::string open = socket + "tokens = \"tokens.json\"\nhttp_port = 8080\nhttp_address = \"0.0.0.0\"\n";
  auto rig = read(replaced(example_, socket, open));
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[api] http_address: other machines would send tokens in the clear"));
  EXPECT_TRUE(read(replaced(example_, socket, open + "insecure_http = true\n"))->api.insecure_http);
  EXPECT_TRUE(read(replaced(example_, socket, open + "proxy = \"192.0.2.7\"\n")));
  rig = read(replaced(example_, socket, open + "proxy = \"192.0.2.7\"\nhttp_origin = \"https://rig.example\"\n"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->api.http_origin, "https://rig.example");
  for (const auto* bad : {"rig.example", "https://", "https://rig.example/page"}) {
    rig = read(replaced(example_, socket, open + "proxy = \"192.0.2.7\"\nhttp_origin = \"" + bad + "\"\n"));
    ASSERT_FALSE(rig) << bad;
    EXPECT_THAT(rig.error().message, HasSubstr("http_origin: is like https://rig.example"));
  }
}

TEST_F(RigConfigTest, AProfileThatIsNotThereOrWrongIsToldAtItsKey) {
  const std::string missing = replaced(example_, "\"leadshine-rs\"", "\"none-such\"");
  auto rig = read(missing);
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[turntable] profile: there is none of "));
  EXPECT_THAT(rig.error().message, HasSubstr((drives_ / "none-such.toml").string()));
  rig = read(replaced(example_, "\"leadshine-rs\"", "\"../../etc/passwd\""));
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[turntable] profile: must be a name, not a path"));
}

TEST_F(RigConfigTest, OtherDriversAreCheckedWithTheirOwnKeys) {
  std::string text = replaced(example_, "driver = \"gpio\"                         # gpio | modbus",
                              "driver = \"manual\"                       # gpio | modbus");
  auto rig = read(text);
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[projector] line: unknown key; known here: driver, warm_up_s"));
  text = replaced(replaced(text, "line = \"PROJ_TRIG\"", "#"), "pulse_us", "#");
  text = replaced(text, "plain_line = \"PROJ_PLAIN\"", "#");
  rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->projector.driver, ProjectorConfig::Driver::manual);

  const std::string panel =
      "[panel]\ndriver = \"modbus-io\"\ndevice = \"/dev/ttyUSB1\"\nbaud = 9600\nparity = \"even\"\nunit_id = 3\n"
      "reply_timeout_ms = 100\npoll_ms = 25\nstart = { channel = 0 }\nreset = { channel = 1, active = \"low\" }\n"
      "lamp_red = { channel = 0 }\n";
  text = with_section("[panel]", "[calibration]", panel);
  rig = read(text);
  ASSERT_FALSE(rig) << "the module watches the e-stop, so it has a channel";
  EXPECT_THAT(rig.error().message, HasSubstr("[safety] estop.channel: missing"));
  text = replaced(text, "estop = { line = \"ESTOP_OK\", active = \"low\" }", "estop = { channel = 7 }");
  text = replaced(text, "guard = { line", "#");
  rig = read(replaced(text, "channel = 7", "channel = 1"));
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[safety] estop: is on the same contact as reset"));
  rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->safety.estop.channel, 7);
  EXPECT_EQ(rig->panel.poll, std::chrono::milliseconds(25));
  EXPECT_EQ(rig->panel.driver, PanelConfig::Driver::modbus_io);
  EXPECT_EQ(rig->panel.io_module.unit_id, 3);
  EXPECT_EQ(rig->panel.inputs.at("reset").channel, 1);
  EXPECT_TRUE(rig->panel.inputs.at("reset").active_low);
}

TEST_F(RigConfigTest, AProjectorOnAnIoModuleNeedsThePanelsModuleAndChannelsOfItsOwn) {
  const std::string projector =
      "[projector]\ndriver = \"modbus-io\"\nchannel = 8\nplain_channel = 9\nactive = \"low\"\npulse_us = 40000\n"
      "warm_up_s = 0\n";
  const std::string panel =
      "[panel]\ndriver = \"modbus-io\"\ndevice = \"/dev/ttyUSB1\"\nbaud = 9600\nparity = \"even\"\nunit_id = 3\n"
      "reply_timeout_ms = 100\npoll_ms = 25\nstart = { channel = 0 }\nreset = { channel = 1 }\n"
      "lamp_red = { channel = 0 }\n";
  const std::string on_gpio = with_section("[projector]", "[stereo_camera]", projector);
  auto rig = read(on_gpio);
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("[projector] driver: \"modbus-io\" uses the panel's I/O module: it needs "
                                             "driver = \"modbus-io\" in [panel]"));
  std::string text = on_gpio.substr(0, on_gpio.find("\n[panel]") + 1) + panel + "\n" +
                     on_gpio.substr(on_gpio.find("\n[calibration]") + 1);
  text = replaced(text, "{ line = \"ESTOP_OK\", active = \"low\" }", "{ channel = 7 }");
  text = replaced(text, "{ line = \"GUARD_OK\", active = \"low\" }", "{ channel = 6 }");
  rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->projector.driver, ProjectorConfig::Driver::modbus_io);
  EXPECT_EQ(rig->projector.line.channel, 8);
  EXPECT_EQ(rig->projector.plain_line.value().channel, 9);
  EXPECT_TRUE(rig->projector.line.active_low);
  EXPECT_EQ(rig->projector.io_module.device, "/dev/ttyUSB1");
  EXPECT_EQ(rig->projector.io_module.unit_id, 3);
  expect_problem_in(text, "plain_channel = 9\n", "",
                    "[projector] plain_channel: missing: every view needs a plain image; name the output that "
                    "fires it",
                    "[projector]\n");
  expect_problem_in(text, "channel = 8", "channel = 0", "[projector] channel: is on the same contact as lamp_red");
  expect_problem_in(text, "pulse_us = 40000", "pulse_us = 11000",
                    "[projector] pulse_us: 11000 is shorter than the longest exposure of 12000 in [stereo_camera]");
}

TEST_F(RigConfigTest, SimulatedCamerasAreKnownOnlyToThoseWhoAskForThem) {
  write(with_section("[stereo_camera]", "[panel]",
                     "[stereo_camera]\ndriver = \"simulated\"\ntruth = \"control.sock\"\nexposure_us = 12000\n"));
  const auto refused = read_rig_config(file_, drives_);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("\"simulated\" is not one of aravis, v4l2, v4l2-side-by-side"));
  const auto rig = read_rig_config(file_, drives_, Cameras::or_simulated);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->stereo_camera.driver, StereoCameraConfig::Driver::simulated);
  EXPECT_EQ(rig->stereo_camera.truth, folder_ / "control.sock");
}

TEST_F(RigConfigTest, RelativePathsStartAtTheFilesFolder) {
  const auto rig = read(replaced(example_, "/var/lib/scanrig/calibration.json", "calibration.json"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->calibration_file, folder_ / "calibration.json");
}

}  // namespace
}  // namespace scanrig::config
