#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "config/drive_profile_file.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"

/// turns PROFILE PORT TURNS PRELOAD_TURNS up|down: the shipped driver turns the table round and round on a clock that
/// runs faster than the wall's; prints what the world saw of it as one line of JSON.
namespace scanrig::bench {
namespace {

constexpr int kFaster = 100;
constexpr double kStepDeg = 120;
constexpr std::chrono::minutes kMoveLimit{10};  ///< six of the wall's seconds: a busy machine is not the subject
constexpr std::chrono::milliseconds kReplyTimeout{1000};
constexpr double kLongestWayDeg = 361;  ///< a way longer than a turn was not asked for by anybody

/// The wall's clock, faster. The wire's own time-outs stay in the wall's time.
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

struct Seen {
  int turns = 0;
  double drift_deg = 0;        ///< of the table at the end of a turn, against the first
  double worst_angle_deg = 0;  ///< what the driver measured, against the true angle
  double longest_way_deg = 0;
  std::string error;
};

Seen go_round(const DriveProfile& profile, const std::filesystem::path& port, int turns, int preload, bool up) {
  FastClock clock;
  sim::wire::LeadshineDrive drive({.gear_ratio = 90, .vibration_decay_s = 0.005}, clock);
  const auto server = sim::wire::ModbusServer::start(port, 1, drive, clock);
  ModbusTurntableOptions options;
  options.line.device = port;
  options.line.reply_timeout = kReplyTimeout;
  options.profile = profile;
  options.scale.gear_ratio = 90;
  options.speed = {180};
  options.acceleration = {1000};
  options.settle = std::chrono::milliseconds(100);
  const auto table = ModbusTurntable::create(options, clock);
  Seen seen;
  const auto limit = [&] { return Deadline::after(clock, kMoveLimit); };
  if (!server || !table) return {.error = "the bench could not begin"};
  if (auto homed = (*table)->home(limit()); !homed) return {.error = homed.error().message};
  drive.preload_counter(static_cast<std::int32_t>(preload * 900'000));
  double zero = NAN, before = drive.truth().table_deg;
  for (; seen.turns <= turns; ++seen.turns) {  // the first leads to zero
    for (const int third : {1, 2, 3}) {
      const double target = std::fmod((up ? third : 3 - third) * kStepDeg, 360.0);
      const auto moved = (*table)->rotate_to({target}, limit());
      if (!moved) {
        seen.error = moved.error().message;
        return seen;
      }
      const double there = drive.truth().table_deg;
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
  if (seen.longest_way_deg > kLongestWayDeg) seen.error = fmt::format("a way of {:.0f} deg", seen.longest_way_deg);
  return seen;
}

}  // namespace
}  // namespace scanrig::bench

int main(int argc, char** argv) {
  using namespace scanrig;
  if (argc != 6) {
    std::fputs("usage: turns PROFILE PORT TURNS PRELOAD_TURNS up|down\n", stderr);
    return 2;
  }
  const auto profile = config::read_drive_profile(argv[1]);
  if (!profile) {
    fmt::print(stderr, "turns: {}\n", profile.error().message);
    return 3;
  }
  const auto seen =
      bench::go_round(*profile, argv[2], std::atoi(argv[3]), std::atoi(argv[4]), std::string_view(argv[5]) == "up");
  fmt::print("{{\"turns\": {}, \"drift_deg\": {:.5f}, \"worst_angle_deg\": {:.5f}, \"longest_way_deg\": {:.2f}}}\n",
             seen.turns, seen.drift_deg, seen.worst_angle_deg, seen.longest_way_deg);
  if (!seen.error.empty()) fmt::print(stderr, "turns: {}\n", seen.error);
  return seen.error.empty() ? 0 : 5;
}
