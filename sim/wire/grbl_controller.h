#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "sim/wire/simulated_drive.h"

namespace scanrig::sim::wire {

/// What runs on the controller.
enum class GrblFirmware { grbl, grblhal, fluidnc };

/// Settings of the controller's first axis; at the table.
struct GrblSettings {
  GrblFirmware firmware = GrblFirmware::grbl;
  double homing_deg_s = 60;
  double acceleration_deg_s2 = 90;
  double max_deg_s = 3600;
  bool homing = true;  ///< $22: locked until homed
};

/// A controller with GRBL 1.1, grblHAL or FluidNC whose X axis turns the table; its unit is a degree of the motor. It
/// keeps positions as GRBL does: counted steps, 32-bit floating point, three decimals. There is no feedback. Threads:
/// every function may be called from any thread.
class GrblController final : public SimulatedDrive {
 public:
  GrblController(const AxisOptions& axis, const GrblSettings& settings, Clock& clock);

  /// Realtime bytes '?', '!', '~', 0x18, 0x85: handled at once. Returns the reply.
  std::string realtime(char byte);
  /// Takes a whole line; its reply comes in turn, see take_output().
  void line(const std::string& text);
  /// Output of the controller, unsolicited or in reply to lines, since the last call.
  std::string take_output();
  static bool is_realtime(char byte);

  using SimulatedDrive::raise_alarm;
  void raise_alarm(std::uint16_t code, bool can_be_reset) override;
  void power_cycle() override;
  void send(std::int32_t pulses) override;

 private:
  enum class State { idle, run, hold, alarm, home };

  void follow() const override;
  void advance() const;
  void carry_out(const std::string& text) const;
  [[nodiscard]] std::string g_code(const std::string& text) const;
  void start_homing() const;
  [[nodiscard]] std::string report() const;
  [[nodiscard]] std::string list_settings() const;
  [[nodiscard]] std::string build_info() const;
  [[nodiscard]] std::string greeting() const;
  [[nodiscard]] std::string lock() const;  ///< what it says when it starts locked
  [[nodiscard]] std::string alarm(int number) const;
  [[nodiscard]] float position() const;  ///< of the machine, units
  [[nodiscard]] AxisMotion motion(double deg_s) const;
  void restart() const;

  const GrblSettings settings_;
  const double gear_ratio_;
  const float steps_per_unit_;
  mutable State state_;
  mutable std::deque<std::string> lines_;
  mutable std::string output_;
  mutable Clock::TimePoint give_up_homing_;
  mutable bool critical_ = false;  // only a reset helps
  mutable int stays_ = 0;          // the alarm that comes back after a reset
};

}  // namespace scanrig::sim::wire
