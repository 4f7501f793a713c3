#include "drivers/turntable/grbl_turntable.h"

#include <string_view>

namespace scanrig {
namespace {

/// Share of the tolerance that GRBL's arithmetic may take.
constexpr double kRoundingShare = 0.25;

MovePlanner::Counter counter_of(const GrblTurntableOptions& options) {
  return GrblDrive::counter(options.tolerance.value * options.scale.pulses_per_degree() * kRoundingShare);
}

}  // namespace

Result<std::unique_ptr<GrblTurntable>> GrblTurntable::create(GrblTurntableOptions options, Clock& clock) {
  options.scale.pulses_per_motor_rev = GrblDrive::kPulsesPerMotorRev;
  if (std::string_view("XYZABC").find(options.drive.axis) == std::string_view::npos) {
    return fail(ErrorCode::out_of_range, "turntable: GRBL has no axis {}", options.drive.axis);
  }
  if (options.home_mode != "here" && options.home_mode != "switch") {
    return fail(ErrorCode::out_of_range, "turntable: GRBL has no homing mode '{}'", options.home_mode);
  }
  if (const auto turn = 360.0 * options.scale.pulses_per_degree(); counter_of(options).max < turn) {
    return fail(ErrorCode::out_of_range,
                "turntable: GRBL's arithmetic cannot keep {} deg over one turn; allow a wider tolerance",
                options.tolerance.value);
  }
  auto drive = std::make_unique<GrblDrive>(options.drive, options.scale, options.home_mode, options.speed,
                                           options.acceleration, clock);
  const auto& link = drive->statistics();
  return std::unique_ptr<GrblTurntable>(new GrblTurntable(options, std::move(drive), link, clock));
}

GrblTurntable::GrblTurntable(const GrblTurntableOptions& options, std::unique_ptr<GrblDrive> drive,
                             const grbl::LinkStatistics& link, Clock& clock)
    : AxisTurntable(options, std::move(drive), options.drive.link.reply_timeout, counter_of(options), clock),
      link_(link) {}

}  // namespace scanrig
