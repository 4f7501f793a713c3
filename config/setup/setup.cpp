#include "config/setup/setup.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "config/rig_toml.h"
#include "config/setup/camera_images.h"
#include "config/setup/find_panel.h"
#include "core/files.h"
#include "drivers/camera/camera_list.h"
#include "drivers/projector/lightcrafter_transport.h"

namespace scanrig::config::setup {

using discovery::SerialDevice;

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kReplyTimeout{100};
constexpr seconds kDriveLimit{2};
constexpr double kShareOfMaxSpeed = 0.9;
constexpr double kPulsesOfTolerance = 2.5;
constexpr int kHomingEnabled = 22;  ///< GRBL's setting $22

}  // namespace

Result<RigConfig> Setup::run() {
  read_present();
  for (const auto step : {&Setup::find_serial_devices, &Setup::find_turntable, &Setup::find_panel,
                          &Setup::find_projector, &Setup::find_cameras}) {
    if (auto done = (this->*step)(); !done) return pass_on(done);
  }
  if (present_.empty()) choose_rest();
  if (auto saved = save(); !saved) return pass_on(saved);
  return rig_;
}

Result<void> Setup::save() const {
  auto draft = options_.out;
  draft += ".new";
  const auto found = rig_toml(rig_);
  const auto text = present_.empty() ? found : with_other_tables(found, present_);
  if (auto written = write_file_atomically(draft, text); !written) return written;
  const auto read = read_rig_config(draft);
  std::error_code ignored;
  std::filesystem::remove(draft, ignored);
  if (read) return write_file_atomically(options_.out, read->text);
  return fail(ErrorCode::internal, "setup: what was found makes no valid rig.toml: {}", read.error().message);
}

/// The named ports, then those of this machine that are not among them under another name.
std::vector<std::string> ports_to_check(std::vector<std::string> ports) {
  const auto place = [](const std::string& port) {
    std::error_code error;
    auto real = std::filesystem::weakly_canonical(port, error);
    return error ? std::filesystem::path(port) : real;
  };
  for (auto& port : discovery::serial_ports()) {
    const auto is_same = [&](const std::string& named) { return place(named) == place(port); };
    if (std::ranges::none_of(ports, is_same)) ports.push_back(std::move(port));
  }
  return ports;
}

void Setup::read_present() {
  if (options_.present.empty()) return;
  auto read = read_rig_config(options_.present);
  if (!read) {
    dialogue_.tell(fmt::format("{} cannot be used and is replaced as a whole.", options_.present.string()));
    return;
  }
  present_ = read->text;
  rig_ = *std::move(read);
  rig_.gpio_socket.reset();
}

Result<void> Setup::find_serial_devices() {
  auto profiles = read_drive_profiles(options_.out);
  if (!profiles) return pass_on(profiles);
  profiles_ = *std::move(profiles);
  const auto ports = ports_to_check(options_.ports);
  for (const auto& port : ports) {
    dialogue_.tell(fmt::format("Checking what is connected to {}.", port));
    auto device = discovery::find_serial_device(port, profiles_, clock_);
    if (!device) {
      dialogue_.tell("  Nothing responds there.");
    } else if (device->kind == SerialDevice::Kind::io_module) {
      dialogue_.tell(fmt::format("  A Modbus I/O module, unit {}.", device->line.unit_id));
      modules_.push_back(*std::move(device));
    } else if (device->kind == SerialDevice::Kind::unknown) {
      dialogue_.tell(fmt::format("  A Modbus device, unit {}, that fits no drive profile.", device->line.unit_id));
    } else {
      const bool grbl = device->kind == SerialDevice::Kind::grbl;
      dialogue_.tell(grbl ? fmt::format("  A GRBL controller: {}.", device->answer)
                          : fmt::format("  A drive: {}, unit {}, {} baud, parity {}.",
                                        fmt::join(device->profiles, " or "), device->line.unit_id, device->line.baud,
                                        discovery::word(device->line.parity)));
      controllers_.push_back(*std::move(device));
    }
  }
  if (!controllers_.empty()) return {};
  return fail(
      ErrorCode::not_found,
      "setup: no drive responds at {}; switch it on, check its adapter, A and B of the RS-485 line, and that "
      "its profile is in drives/, then run setup again",
      ports.empty() ? std::string("any serial port: there is none") : fmt::format("{}", fmt::join(ports, ", ")));
}

Result<void> Setup::find_turntable() {
  std::vector<std::string> names;
  for (const auto& device : controllers_) names.push_back(device.line.device);
  const auto which = dialogue_.choose("Which one turns the table?", names);
  if (!which) return pass_on(which);
  const auto& device = controllers_[*which];
  auto used = device.kind == SerialDevice::Kind::grbl ? use_grbl(device) : use_drive(device);
  return used ? choose_motion() : used;
}

Result<void> Setup::use_drive(const SerialDevice& device) {
  const auto which = dialogue_.choose("Which profile is that drive's?", device.profiles);
  if (!which) return pass_on(which);
  auto& turntable = rig_.turntable;
  turntable.driver = TurntableConfig::Driver::modbus;
  auto& options = turntable.modbus;
  options.profile = profiles_.at(device.profiles[*which]);
  options.line = device.line;
  options.line.reply_timeout = kReplyTimeout;
  turntable.profile_file = SourceFile{device.profiles[*which] + ".toml", ""};
  ModbusDrive drive(options.line, options.profile, clock_);
  const auto pulses = drive.read_pulses_per_motor_rev(Deadline::after(clock_, kDriveLimit));
  if (!pulses) return pass_on(pulses, "setup");
  options.scale.pulses_per_motor_rev = *pulses;
  const auto& modes = options.profile.homing.modes;
  const auto* preferred = options.profile.homing.absolute ? "absolute" : "switch";
  options.home_mode = modes.contains(preferred) || modes.empty() ? preferred : modes.begin()->first;
  return {};
}

Result<void> Setup::use_grbl(const SerialDevice& device) {
  rig_.turntable.driver = TurntableConfig::Driver::grbl;
  auto& options = rig_.turntable.grbl;
  options.drive.link.device = device.line.device;
  options.scale.pulses_per_motor_rev = GrblDrive::kPulsesPerMotorRev;
  grbl::Link link(options.drive.link, clock_);
  const auto settings = link.settings(Deadline::after(clock_, kDriveLimit));
  if (!settings) return pass_on(settings, "setup");
  const auto homing = settings->find(kHomingEnabled);
  const bool has_switch = homing != settings->end() && homing->second != 0;
  options.home_mode = has_switch ? "switch" : "here";
  if (!has_switch)
    dialogue_.tell("  Its homing is off ($22 = 0): the table's position at each Reset becomes its zero.");
  return {};
}

/// Rounded up: `value` in steps of 0.0001.
double in_ten_thousandths(double value) { return std::ceil(value * 1e4) / 1e4; }

Result<void> Setup::choose_motion() {
  const auto gear = dialogue_.prompt_number("How many turns does the motor make for one turn of the table?", 0.1, 1000);
  if (!gear) return pass_on(gear);
  auto& options = motion();
  options.scale.gear_ratio = *gear;
  options.tolerance.value =
      std::max(options.tolerance.value, in_ten_thousandths(kPulsesOfTolerance / options.scale.pulses_per_degree()));
  if (rig_.turntable.driver == TurntableConfig::Driver::modbus) {
    const double max_deg_s = kShareOfMaxSpeed * rig_.turntable.modbus.profile.max_motor_rpm * 6.0 / *gear;
    options.speed.value = std::min(options.speed.value, std::floor(max_deg_s * 10.0) / 10.0);
  }
  return {};
}

Result<void> Setup::find_panel() {
  const auto lines =
      options_.gpio_socket.empty() ? gpio::chip_lines(clock_) : gpio::socket_lines(options_.gpio_socket, clock_);
  if (!options_.gpio_socket.empty()) rig_.gpio_socket = std::filesystem::absolute(options_.gpio_socket);
  auto wiring = setup::find_panel(*lines, modules_, dialogue_, clock_);
  if (!wiring) return pass_on(wiring);
  rig_.panel = std::move(wiring->panel);
  rig_.panel.io_module.reply_timeout = kReplyTimeout;
  rig_.safety.estop = wiring->estop;
  rig_.safety.guard = wiring->guard;
  if (!rig_.safety.guard) {  // what only a guard allows
    rig_.safety.remote_start = false;
    rig_.safety.home_after_restart = SafetyConfig::HomeAfterRestart::on_reset;
  }
  lights_ = std::move(wiring->lights);
  return {};
}

Result<void> Setup::find_projector() {
  using Driver = ProjectorConfig::Driver;
  auto& projector = rig_.projector;
  const bool is_on_usb = dlpc350::usb_transport("", clock_)().has_value();
  if (lights_.contains("pattern") && lights_.contains("plain")) {
    projector.driver = lights_.at("pattern").line.empty() ? Driver::modbus_io : Driver::gpio;
    projector.line = lights_.at("pattern");
    projector.plain_line = lights_.at("plain");
    if (projector.driver == Driver::modbus_io) projector.pulse = std::chrono::microseconds(40'000);
    dialogue_.tell(fmt::format("The projector is switched by {}.",
                               projector.driver == Driver::gpio ? "PROJ_TRIG and PROJ_PLAIN" : "the I/O module"));
    return {};
  }
  if (is_on_usb) {
    projector.driver = Driver::lightcrafter4500;
    dialogue_.tell("The projector is the LightCrafter 4500 on USB.");
    return {};
  }
  const auto how = dialogue_.choose(
      "How is the projector switched?",
      {"by outputs of the left camera, Line1 the pattern and Line2 plain light", "by hand: its pattern stays on"});
  if (!how) return pass_on(how);
  projector.driver = *how == 0 ? Driver::camera_strobe : Driver::manual;
  if (*how == 0) {
    projector.line.line = "Line1";
    projector.plain_line.emplace().line = "Line2";
  }
  return {};
}

/// The first of `wanted` that the camera has, else the first that starts with `prefix`.
std::string first_of(const std::vector<std::string>& offered, const std::vector<std::string>& wanted,
                     std::string_view prefix) {
  for (const auto& name : wanted) {
    if (std::ranges::find(offered, name) != offered.end()) return name;
  }
  const auto like = std::ranges::find_if(offered, [&](const auto& name) { return name.starts_with(prefix); });
  return like == offered.end() ? "" : *like;
}

/// A format with colour. Fails with `unsupported`.
Result<std::string> colour_format(const std::string& serial, const CameraCapabilities& camera) {
  auto format = first_of(camera.pixel_formats,
                         {"BayerRG8", "BayerGR8", "BayerGB8", "BayerBG8", "RGB8", "BGR8", "YUV422_8"}, "Bayer");
  if (!format.empty()) return format;
  return fail(ErrorCode::unsupported,
              "setup: camera {} has no colour format ({}); colour separates the object from the blue screen", serial,
              fmt::join(camera.pixel_formats, ", "));
}

template <class T>
std::vector<T> without(std::vector<T> all, std::size_t index) {
  if (index < all.size()) all.erase(all.begin() + static_cast<std::ptrdiff_t>(index));
  return all;
}

Result<void> Setup::find_cameras() {
  dialogue_.tell("Looking for cameras.");
  const auto found = find_aravis_cameras();
  if (found.size() < 2) {
    return fail(ErrorCode::not_found,
                "setup: {} GigE or USB3 Vision cameras found, and two are needed; check power, cables and network "
                "(scanrig camera list), then run setup again. V4L2 cameras are named by hand in rig.toml",
                found.size());
  }
  const auto capabilities = aravis_capabilities(found[0].serial);
  if (!capabilities) return pass_on(capabilities, "setup");
  const auto format = colour_format(found[0].serial, *capabilities);
  if (!format) return pass_on(format);
  std::vector<std::string> names;
  for (const auto& camera : found)
    names.push_back(fmt::format("{} {} at {}", camera.name, camera.serial, camera.where));
  CameraImages images;
  if (!options_.images.empty()) images = take_images(found, *format, options_.images, clock_);
  if (!images.trouble.empty()) dialogue_.tell(fmt::format("Not every camera gave an image: {}.", images.trouble));
  const auto left =
      dialogue_.choose("Which camera is on the left, seen from behind both cameras?", names, images.files);
  if (!left) return pass_on(left);
  const auto other =
      dialogue_.choose("Which camera is on the right?", without(names, *left), without(images.files, *left));
  if (!other) return pass_on(other);
  return use_cameras(found[*left], found[*other < *left ? *other : *other + 1]);
}

Result<void> Setup::use_cameras(const FoundCamera& left, const FoundCamera& right) {
  auto& options = rig_.stereo_camera.aravis;
  rig_.stereo_camera.driver = StereoCameraConfig::Driver::aravis;
  const auto use = [&](const FoundCamera& camera) -> AravisSensorOptions {
    return {camera.serial, camera.kind == "GigEVision" ? camera.where : ""};
  };
  options.left = use(left);
  options.right = use(right);
  const auto capabilities = aravis_capabilities(left.serial);
  if (!capabilities) return pass_on(capabilities, "setup");
  auto format = colour_format(left.serial, *capabilities);
  if (!format) return pass_on(format);
  options.pixel_format = *std::move(format);
  const bool stays_on = rig_.projector.driver == ProjectorConfig::Driver::manual;
  options.trigger_source = stays_on ? "Software" : first_of(capabilities->trigger_sources, {"Line0", "Line1"}, "Line");
  if (!options.trigger_source.empty()) return {};
  return fail(ErrorCode::unsupported, "setup: camera {} has no trigger input", left.serial);
}

void Setup::choose_rest() {
  const auto state = std::filesystem::absolute(options_.state);
  rig_.calibration_file = state / "calibration.json";
  rig_.recipes["default"] = {};
  rig_.storage.root = state / "jobs";
  rig_.api.socket = options_.state == SetupOptions().state ? "/run/scanrig/api.sock" : state / "api.sock";
  rig_.api.tokens = state / "tokens.json";
  if (options_.http_port != 0) rig_.api.http_port = options_.http_port;
}

}  // namespace scanrig::config::setup
