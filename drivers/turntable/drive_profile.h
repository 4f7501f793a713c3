#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace scanrig {

/// What one family of Modbus drives is like: registers, bits and units, as data (a file in config/drives/).
/// 32-bit values lie in two registers, high word first.
struct DriveProfile {
  /// A value that makes the drive do something when written.
  struct Trigger {
    std::uint16_t address = 0;
    std::uint16_t value = 0;
    std::optional<std::uint16_t> release{};  ///< written next, for a drive that acts when a bit changes
  };

  /// The block that starts an absolute move, written in one request.
  struct Move {
    enum class Word {
      constant,
      position_high,
      position_low,
      speed_high,
      speed,
      acceleration_high,
      acceleration,
      deceleration_high,
      deceleration
    };
    struct Item {
      Word word = Word::constant;
      std::uint16_t value = 0;  ///< of a constant
    };
    std::uint16_t address = 0;
    std::vector<Item> words;

    /// The largest speed or acceleration that fits the block.
    [[nodiscard]] double largest(Word high) const;
  };

  /// Masks of the status register; a state holds when all bits of its mask are set, so an empty mask always holds.
  struct Status {
    std::uint16_t address = 0;
    std::uint16_t fault = 0;
    std::uint16_t enabled = 0;
    std::uint16_t running = 0;
    std::uint16_t in_position = 0;
    std::uint16_t homed = 0;
    bool homed_stays = true;  ///< false: it is told until the next motion only
  };

  struct Homing {
    std::optional<std::uint16_t> mode_address;
    std::map<std::string, std::uint16_t> modes;   ///< "switch", "limit", "encoder"
    std::optional<std::uint16_t> speeds_address;  ///< fast speed, slow speed, acceleration, deceleration
    bool zero_is_known = false;                   ///< an absolute encoder: at home nothing moves
    Trigger start;
    std::optional<Trigger> set_zero;  ///< declares the present position home
  };

  struct SoftLimits {
    std::uint16_t control_address = 0;
    std::uint16_t control_mask = 0;  ///< set to switch them on
    std::uint16_t address = 0;       ///< plus limit, then minus limit, 32 bit each
  };

  struct Alarm {
    enum class Reset { by_register, power_cycle };
    std::uint16_t address = 0;
    std::map<std::uint16_t, std::string> words;
    Reset reset = Reset::by_register;
    Trigger reset_trigger;
  };

  enum class SpeedUnit { rpm, pulses_per_s };
  enum class AccelerationUnit { ms_per_1000_rpm, pulses_per_s2 };

  std::string name;
  std::string models;
  int min_unit_id = 1;
  int max_unit_id = 31;
  SpeedUnit speed_unit = SpeedUnit::rpm;
  AccelerationUnit acceleration_unit = AccelerationUnit::ms_per_1000_rpm;
  double max_motor_rpm = 3000;
  std::optional<std::uint16_t> pulses_per_motor_rev_address;
  std::optional<Trigger> enable;
  Trigger stop;
  Move move;
  Status status;
  std::uint16_t feedback_address = 0;  ///< measured position in pulses, 32 bit
  Homing homing;
  std::optional<SoftLimits> soft_limits;
  Alarm alarm;
};

}  // namespace scanrig
