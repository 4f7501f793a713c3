#include "sim/apps/wire_rig.h"

#include <cmath>

#include "core/files.h"
#include "sim/scene/rest_error.h"
#include "sim/wire/grbl_server.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/oriental_drive.h"

namespace scanrig::sim {
namespace {

/// Table angles of a job: the table is wound up from pose to pose, and each pose may end with its first view once more.
/// Angles beyond two turns repeat, see rest_error_deg().
std::vector<Place> places_of_job(const WireRigOptions& o) {
  const double pulses_per_deg = o.toml.pulses_per_motor_rev * o.toml.gear_ratio / 360.0;
  std::vector<Place> places;
  for (int pose = 0; pose < o.toml.poses; ++pose) {
    for (int view = 0; view <= o.toml.views; ++view) {
      const double wanted = 360.0 * (pose + static_cast<double>(view) / o.toml.views);
      const double sent_to = std::round(wanted * pulses_per_deg) / pulses_per_deg;
      places.push_back({pose, resting_angle(sent_to, o.scene->seed)});
    }
  }
  return places;
}

/// The mechanics of the profile instead of the given ones, as in sim/devices: the images of a scan must not depend on
/// the kind of simulation.
wire::AxisOptions axis_of(const WireRigOptions& o) {
  wire::AxisOptions axis = o.axis;
  if (!o.scene) return axis;
  constexpr double kDecays = 5.0;  // after so many, the vibration is gone
  axis.vibration_deg = profile().vibration_deg;
  axis.vibration_decay_s = profile().settling_s / kDecays;
  axis.encoder_step_deg = profile().encoder_step_deg;
  axis.rest_error_deg = [seed = o.scene->seed](double sent_to) { return rest_error_deg(sent_to, seed); };
  return axis;
}

}  // namespace

Result<std::unique_ptr<WireRig>> WireRig::start(const WireRigOptions& o, Clock& clock) {
  if (o.toml.panel != "gpio" && o.toml.panel != "modbus-io") {
    return fail(ErrorCode::unsupported, "no simulated panel {}", o.toml.panel);
  }
  if (auto made = create_directories_synced(o.toml.folder); !made) return pass_on(made);
  std::unique_ptr<WireRig> rig(new WireRig(o.toml.folder / "turntable"));
  rig->positive_ccw_ = o.positive_ccw;
  if (auto connected = rig->connect_drive(o, clock); !connected) return pass_on(connected);
  if (o.preload_counter) rig->drive_->preload_counter(*o.preload_counter);
  auto panel = RigPanel::start(o.toml.folder, o.toml.panel == "modbus-io", clock);
  if (!panel) return pass_on(panel);
  rig->panel_ = std::move(*panel);
  if (auto started = rig->start_cameras(o, clock); !started) return pass_on(started);
  if (auto written = write_rig_toml(o.toml); !written) return pass_on(written);
  return rig;
}

WireRig::~WireRig() {
  if (cameras_) panel_->on_light({});
}

Result<void> WireRig::start_cameras(const WireRigOptions& o, Clock& clock) {
  if (!o.scene) return {};
  auto expected = places_of_job(o);
  expected.push_back({0, truth().angle_deg});  // for cameras tested before homing
  auto cameras = RigCameras::start(
      {.scene = *o.scene,
       .expected = expected,
       .numbered = o.numbered_frames,
       .max_exposure_us = o.max_exposure_us,
       .state = o.camera_state},
      [this] { return truth(); }, clock);
  if (!cameras) return pass_on(cameras);
  cameras_ = std::move(*cameras);
  panel_->on_light([&cameras = *cameras_](bool pattern, bool on) { on ? cameras.edge(pattern) : cameras.light_out(); });
  return cameras_->write_calibration(o.toml.folder / "calibration.json");
}

Result<void> WireRig::connect_drive(const WireRigOptions& o, Clock& clock) {
  const wire::AxisOptions axis = axis_of(o);
  const auto serve = [&](auto drive, const auto& start) -> Result<void> {
    auto server = start(*drive);
    if (!server) return pass_on(server);
    drive_ = std::move(drive);
    server_ = std::move(*server);
    server_->set_line({});
    return {};
  };
  const auto modbus = [&](auto& drive) { return wire::ModbusServer::start(port_, 1, drive, clock); };
  if (o.toml.drive == "leadshine-rs") return serve(std::make_unique<wire::LeadshineDrive>(axis, clock), modbus);
  if (o.toml.drive == "oriental-az") return serve(std::make_unique<wire::OrientalDrive>(axis, clock), modbus);
  if (o.toml.drive == "grbl") {
    const wire::GrblSettings settings{.acceleration_deg_s2 = o.toml.acceleration_deg_s2};
    return serve(std::make_unique<wire::GrblController>(axis, settings, clock),
                 [&](auto& controller) { return wire::GrblServer::start(port_, controller, clock); });
  }
  return fail(ErrorCode::unsupported, "no simulated drive {}", o.toml.drive);
}

RigTruth WireRig::truth() const {
  const std::scoped_lock lock(mutex_);
  const auto axis = drive_->truth();
  const double sign = positive_ccw_ ? 1.0 : -1.0;
  return {.angle_deg = sign * axis.table_deg,
          .speed_deg_s = sign * axis.speed_deg_s,
          .stopped = !axis.moving,
          .projector_on = panel_->light(),
          .counter = drive_->counter(),
          .powered = powered_};
}

Result<Clock::TimePoint> WireRig::press(const std::string& input, bool pressed) {
  auto at = panel_->press(input, pressed);
  if (!at || input != "estop") return at;
  const std::scoped_lock lock(mutex_);
  const bool power = !(pressed && estop_cuts_power_);
  if (power != powered_) drive_->power_cycle();
  powered_ = power;
  apply_fault();
  return at;
}

void WireRig::set_fault(std::optional<wire::WireFault> fault) {
  const std::scoped_lock lock(mutex_);
  fault_ = fault;
  apply_fault();
}

void WireRig::apply_fault() {
  server_->clear_faults();
  if (!powered_) {
    server_->inject({.kind = wire::WireFault::Kind::request_lost});
  } else if (fault_) {
    server_->inject(*fault_);
  }
}

Result<void> WireRig::plug_in(bool plugged) {
  if (plugged) return server_->come_back();
  server_->vanish();
  return {};
}

void WireRig::set_estop_cuts_power(bool cuts) {
  const std::scoped_lock lock(mutex_);
  estop_cuts_power_ = cuts;
}

void WireRig::set_positive_ccw(bool ccw) {
  const std::scoped_lock lock(mutex_);
  positive_ccw_ = ccw;
}

}  // namespace scanrig::sim
