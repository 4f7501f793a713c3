#include "tests/bench/turns/go_round.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "config/drive_profile_file.h"
#include "drivers/turntable/grbl_turntable.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/wire/grbl_server.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/oriental_drive.h"

namespace scanrig::bench {
namespace {

constexpr int kFaster = 100;
constexpr double kStepDeg = 120;
constexpr std::chrono::minutes kMoveLimit{10};  ///< six seconds of the wall clock: a busy machine is not the subject
constexpr double kMaxWayDeg = 361;              ///< no request needs a way longer than a turn

/// The wall clock, faster. The wire's own time-outs stay in wall time.
class FastClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return origin_ + kFaster * (wall_.now() - origin_); }
  bool wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& changed, TimePoint until,
                  const std::function<bool()>& ready) override {
    return changed.wait_until(lock, origin_ + (until - origin_) / kFaster, ready);
  }
  void notify_all(std::condition_variable& changed) override { changed.notify_all(); }

 private:
  RealClock wall_;
  TimePoint origin_ = wall_.now();
};

const sim::wire::AxisOptions kAxis{.gear_ratio = 90, .vibration_decay_s = 0.005};
constexpr double kPulsesPerTurn = 900'000;
constexpr std::chrono::milliseconds kModbusReply{1000};  ///< wall time: a busy machine is no fault of the wire
/// Fast-clock time: long enough that the wall clock's delays are no time-outs.
constexpr std::chrono::milliseconds kGrblReply{20000};

/// A driver, and the drive at the other end of its wire.
struct Rig {
  std::unique_ptr<sim::wire::SimulatedDrive> drive;
  std::unique_ptr<sim::wire::WireServer> server;
  std::unique_ptr<Turntable> table;
};

void set_motion(AxisTurntableOptions& options) {
  options.scale.gear_ratio = kAxis.gear_ratio;
  options.speed = {180};
  options.acceleration = {1000};
  options.settle = std::chrono::milliseconds(100);
}

Result<Rig> grbl_rig(const std::filesystem::path& port, Clock& clock) {
  auto controller =
      std::make_unique<sim::wire::GrblController>(kAxis, sim::wire::GrblSettings{.acceleration_deg_s2 = 1000}, clock);
  auto server = sim::wire::GrblServer::start(port, *controller, clock);
  if (!server) return pass_on(server);
  GrblTurntableOptions options;
  set_motion(options);
  options.drive.link.device = port;
  options.drive.link.reply_timeout = kGrblReply;
  auto table = GrblTurntable::create(options, clock);
  if (!table) return pass_on(table);
  return Rig{std::move(controller), std::move(*server), std::move(*table)};
}

template <class Drive>
Result<Rig> modbus_rig(const DriveProfile& profile, const std::filesystem::path& port, Clock& clock) {
  auto drive = std::make_unique<Drive>(kAxis, clock);
  auto server = sim::wire::ModbusServer::start(port, 1, *drive, clock);
  if (!server) return pass_on(server);
  ModbusTurntableOptions options;
  set_motion(options);
  options.line.device = port;
  options.line.reply_timeout = kModbusReply;
  options.profile = profile;
  if (profile.homing.absolute) options.home_mode = "absolute";
  auto table = ModbusTurntable::create(options, clock);
  if (!table) return pass_on(table);
  return Rig{std::move(drive), std::move(*server), std::move(*table)};
}

Result<Rig> make_rig(const std::string& drive, const std::filesystem::path& profiles, const std::filesystem::path& port,
                     Clock& clock) {
  if (drive == "grbl") return grbl_rig(port, clock);
  auto profile = config::read_drive_profile(profiles / (drive + ".toml"));
  if (!profile) return pass_on(profile);
  // The drive's watch over its commander runs on the fast clock: it would stop the motor after 30 ms of a busy machine.
  profile->communication_timeout.reset();
  if (drive == "oriental-az") return modbus_rig<sim::wire::OrientalDrive>(*profile, port, clock);
  return modbus_rig<sim::wire::LeadshineDrive>(*profile, port, clock);
}

}  // namespace

Seen go_round(const std::string& name, const std::filesystem::path& profiles, const std::filesystem::path& port,
              int turns, int preload_turns, bool up) {
  FastClock clock;
  Seen seen;
  const auto limit = [&] { return Deadline::after(clock, kMoveLimit); };
  const auto rig = make_rig(name, profiles, port, clock);
  if (!rig) return {.error = rig.error().message};
  const auto& [drive, server, table] = *rig;
  if (auto homed = table->home(limit()); !homed) return {.error = homed.error().message};
  if (preload_turns != 0) drive->preload_counter(static_cast<std::int32_t>(preload_turns * kPulsesPerTurn));
  double zero = NAN, before = drive->truth().table_deg;
  for (; seen.turns <= turns; ++seen.turns) {  // the first leads to zero
    for (const int third : {1, 2, 3}) {
      const double target = std::fmod((up ? third : 3 - third) * kStepDeg, 360.0);
      const auto moved = table->rotate_to({target}, limit());
      if (!moved) {
        seen.error = moved.error().message;
        return seen;
      }
      const double there = drive->truth().table_deg;
      if (std::isnan(zero) && third == 3) zero = there;
      seen.longest_way_deg = std::max(seen.longest_way_deg, std::abs(there - before));
      before = there;
      if (std::isnan(zero)) continue;
      const double off = std::abs(std::remainder(there - zero - moved->measured.value, 360.0));
      seen.worst_angle_deg = std::max(seen.worst_angle_deg, off);
      if (third == 3) seen.drift_deg = std::max(seen.drift_deg, std::abs(std::remainder(there - zero, 360.0)));
    }
  }
  --seen.turns;
  if (seen.longest_way_deg > kMaxWayDeg) seen.error = fmt::format("a way of {:.0f} deg", seen.longest_way_deg);
  return seen;
}

}  // namespace scanrig::bench
