#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace scanrig {

/// Description of one family of Modbus drives: registers, bits and units, as data (a file in config/drives/).
/// 32-bit values are in two registers, high word first.
struct DriveProfile {
  /// A value that starts an action of the drive when written.
  struct Trigger {
    std::uint16_t address = 0;
    std::uint16_t value = 0;
    bool momentary = false;  ///< an input that must be reset: 0 is written after the value
  };

  /// Words written in one request.
  struct Block {
    enum class Word { constant, position, speed, slow_speed, acceleration, deceleration };
    struct Item {
      Word word = Word::constant;
      bool high = false;        ///< the upper half of a 32-bit value
      std::uint16_t value = 0;  ///< value of a constant
    };
    std::uint16_t address = 0;
    std::vector<Item> words;

    [[nodiscard]] bool has(Word word, bool high) const {
      for (const Item& item : words) {
        if (item.word == word && item.high == high) return true;
      }
      return false;
    }
  };

  /// Pulses per motor turn: `base`, times and divided by the content of two registers, where there are any.
  struct Resolution {
    int base = 1;
    std::optional<std::uint16_t> multiply_address;
    std::optional<std::uint16_t> divide_address;
  };

  /// Masks of the status register; a state holds when all bits of its mask are set.
  struct Status {
    std::uint16_t address = 0;
    std::uint16_t fault = 0;
    std::uint16_t enabled = 0;  ///< 0: the drive does not report it, and counts as enabled
    std::uint16_t running = 0;
    std::uint16_t in_position = 0;
    std::uint16_t homed = 0;
  };

  struct Homing {
    std::optional<std::uint16_t> mode_address;
    std::map<std::string, std::uint16_t> modes;  ///< "switch", "limit", "absolute"
    bool absolute = false;  ///< the encoder stores the zero: homing searches for nothing, it only moves there
    std::optional<Block> speeds;
    Trigger start;
    Trigger set_zero;  ///< declares the present position home
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

  /// The drive stops on its own when it has received nothing for this long; 0 in the register: never.
  struct CommunicationTimeout {
    std::uint16_t address = 0;  ///< milliseconds
    std::chrono::milliseconds timeout{3000};
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
  Resolution pulses_per_motor_rev;
  std::optional<Trigger> enable;
  Trigger stop;
  Block move;  ///< starts an absolute move
  Status status;
  std::uint16_t feedback_address = 0;  ///< measured position in pulses, 32 bit
  Homing homing;
  std::optional<SoftLimits> soft_limits;
  Alarm alarm;
  std::optional<CommunicationTimeout> communication_timeout;  ///< nothing: the drive has none, or none is documented
};

}  // namespace scanrig
