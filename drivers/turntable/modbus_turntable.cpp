#include "drivers/turntable/modbus_turntable.h"

#include <limits>

namespace scanrig {
namespace {

constexpr double kSlowHoming = 0.2;  ///< of the working speed, for the last approach of the switch
constexpr double kFastHoming = 0.5;

/// Motion values in the drive's own units. Fails with `out_of_range`.
Result<DriveMotion> motion_of(const ModbusTurntableOptions& options, double share) {
  const auto speed = [&](double of) { return options.scale.speed_word({options.speed.value * of}, options.profile); };
  const auto usual = speed(share), slow = speed(kSlowHoming);
  const auto acceleration = options.scale.acceleration_word(options.acceleration, options.profile);
  if (!usual) return pass_on(usual);
  if (!slow) return pass_on(slow);
  if (!acceleration) return pass_on(acceleration);
  return DriveMotion{*usual, *acceleration, *acceleration, *slow};
}

}  // namespace

/// The drive, with the motions that it will make.
class ModbusTurntable::Drive final : public AxisDrive {
 public:
  Drive(const ModbusTurntableOptions& options, const DriveMotion& motion, const DriveMotion& homing, Clock& clock)
      : drive_(options.line, options.profile, clock),
        profile_(options.profile),
        scale_(options.scale),
        home_mode_(options.home_mode),
        motion_(motion),
        homing_(homing) {}

  Result<DriveState> read_state(Deadline deadline) override { return drive_.read_state(deadline); }
  Result<std::string> read_alarm(Deadline deadline) override { return drive_.read_alarm(deadline); }
  Result<void> reset_alarm(Deadline deadline) override { return drive_.reset_alarm(deadline); }

  Result<void> check(Deadline deadline) override {
    const auto pulses = drive_.read_pulses_per_motor_rev(deadline);
    if (!pulses) return pass_on(pulses);
    if (*pulses == scale_.pulses_per_motor_rev) return {};
    return fail(ErrorCode::protocol, "the drive is set to {} pulses a motor turn, the configuration says {}", *pulses,
                scale_.pulses_per_motor_rev);
  }
  Result<void> enable(Deadline deadline) override { return drive_.enable(deadline); }
  Result<void> prepare_homing(Deadline deadline) override { return drive_.set_homing(home_mode_, homing_, deadline); }
  Result<void> start_homing(Deadline deadline) override { return drive_.start_homing(deadline); }
  Result<void> set_zero(Deadline deadline) override { return drive_.set_zero(deadline); }
  [[nodiscard]] bool knows_zero() const override { return drive_.knows_zero(); }
  Result<void> set_soft_limits(const MovePlanner::Counter& range, Deadline deadline) override {
    return drive_.set_soft_limits(range, deadline);
  }

  Result<void> set_speed(DegreesPerSecond speed) override {
    const auto word = scale_.speed_word(speed, profile_);
    if (!word) return pass_on(word);
    motion_.speed = *word;
    return {};
  }
  Result<void> start_move(std::int32_t target, Deadline deadline) override {
    return drive_.start_move(target, motion_, deadline);
  }

  Result<void> guard_connection(bool on, Deadline deadline) override { return drive_.guard_connection(on, deadline); }
  Result<void> stop(Deadline deadline) override { return drive_.stop(deadline); }
  void stop_without_reply() override { drive_.stop_without_reply(); }
  void set_fail_fast(bool on) noexcept override { drive_.set_fail_fast(on); }
  [[nodiscard]] bool reply_missed() const override { return drive_.reply_missed(); }
  void count_retry() override { drive_.count_retry(); }
  [[nodiscard]] const modbus::ClientStatistics& statistics() const { return drive_.statistics(); }

 private:
  ModbusDrive drive_;
  const DriveProfile profile_;
  const AxisScale scale_;
  const std::string home_mode_;
  DriveMotion motion_;
  const DriveMotion homing_;
};

Result<std::unique_ptr<ModbusTurntable>> ModbusTurntable::create(ModbusTurntableOptions options, Clock& clock) {
  const auto motion = motion_of(options, 1.0), homing = motion_of(options, kFastHoming);
  if (!motion) return pass_on(motion, "turntable");
  if (!homing) return pass_on(homing, "turntable");
  if (options.home_mode != "here" && !options.profile.homing.modes.contains(options.home_mode)) {
    return fail(ErrorCode::out_of_range, "turntable: {} has no homing mode '{}'", options.profile.name,
                options.home_mode);
  }
  auto drive = std::make_unique<Drive>(options, *motion, *homing, clock);
  const auto& line = drive->statistics();
  return std::unique_ptr<ModbusTurntable>(new ModbusTurntable(options, std::move(drive), line, clock));
}

ModbusTurntable::ModbusTurntable(const ModbusTurntableOptions& options, std::unique_ptr<Drive> drive,
                                 const modbus::ClientStatistics& line, Clock& clock)
    : AxisTurntable(options, std::move(drive), options.line.reply_timeout,
                    {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()}, clock),
      line_(line) {}

}  // namespace scanrig
