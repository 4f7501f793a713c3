#pragma once

#include <string>

#include "drivers/turntable/axis_drive.h"
#include "drivers/turntable/grbl_link.h"

namespace scanrig {

struct GrblDriveOptions {
  grbl::LinkOptions link;
  char axis = 'X';  ///< the controller's axis that turns the table
};

/// One axis of a GRBL 1.1 controller whose unit ("mm") is a degree of the motor. A pulse is a thousandth of it, the
/// last decimal that GRBL reports. GRBL counts its steps and measures nothing.
class GrblDrive final : public AxisDrive {
 public:
  static constexpr int kPulsesPerMotorRev = 360'000;
  /// GRBL holds positions as 32-bit floating point. Largest distance of the axis from its zero at which positions are
  /// known within `pulses`. Never beyond the range that GRBL can report.
  static MovePlanner::Counter counter(double pulses);

  GrblDrive(GrblDriveOptions options, const AxisScale& scale, std::string home_mode, DegreesPerSecond speed,
            DegreesPerSecond2 acceleration, Clock& clock)
      : link_(std::move(options.link), clock),
        axis_(options.axis),
        scale_(scale),
        home_mode_(std::move(home_mode)),
        speed_(speed),
        acceleration_(acceleration) {}

  Result<DriveState> read_state(Deadline deadline) override;
  Result<std::string> read_alarm(Deadline deadline) override;
  Result<void> reset_alarm(Deadline deadline) override;
  Result<void> check(Deadline deadline) override;
  Result<void> enable(Deadline) override { return {}; }
  Result<void> prepare_homing(Deadline) override { return {}; }
  Result<void> start_homing(Deadline deadline) override;
  Result<void> set_zero(Deadline deadline) override;
  Result<void> set_soft_limits(const MovePlanner::Counter&, Deadline) override { return {}; }
  Result<void> set_speed(DegreesPerSecond speed) override {
    speed_ = speed;
    return {};
  }
  Result<void> start_move(std::int32_t target, Deadline deadline) override;
  Result<void> stop(Deadline deadline) override;
  void stop_without_reply() override;
  void set_fail_fast(bool on) noexcept override { link_.set_fail_fast(on); }
  [[nodiscard]] bool reply_missed() const override { return link_.reply_missed(); }
  void count_retry() override { link_.count_retry(); }

  [[nodiscard]] const grbl::LinkStatistics& statistics() const { return link_.statistics(); }

 private:
  Result<DriveState> watch_homing(Deadline deadline);
  Result<grbl::Report> exchange(Deadline deadline);
  /// Position of the machine in pulses.
  Result<double> position_in(const grbl::Report& report) const;
  Result<void> leave_hold(Deadline deadline);
  [[nodiscard]] grbl::Alarm alarm() const;
  [[nodiscard]] int index() const;

  grbl::Link link_;
  const char axis_;
  const AxisScale scale_;
  const std::string home_mode_;
  DegreesPerSecond speed_;
  const DegreesPerSecond2 acceleration_;
  grbl::State last_ = grbl::State::idle;
  double zero_ = 0;  // machine position of home, pulses
  double seen_ = 0;  // machine position reported last, pulses
  bool homed_ = false;
  bool homing_ = false;  // "$H" was sent and has no reply yet; meanwhile GRBL replies to nothing else
};

}  // namespace scanrig
