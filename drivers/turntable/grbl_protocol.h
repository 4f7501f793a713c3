#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scanrig::grbl {

// Output of a GRBL 1.1 controller [gnea/grbl wiki: Interface, Commands; doc/csv] and of two firmwares that speak its
// language: grblHAL [grblHAL/core: report.c, alarms.h, errors.h], FluidNC [bdring/FluidNC: Report.cpp, Protocol.h,
// SettingsDefinitions.cpp].

enum class Firmware { grbl, grblhal, fluidnc };

enum class State { idle, run, hold, jog, alarm, door, check, home, sleep, tool };

/// A status report, "<Idle|MPos:0.000,0.000,0.000|FS:0,0>".
struct Report {
  State state = State::idle;
  bool underway = false;         ///< a hold or door that is not complete: the axes still move
  std::vector<double> position;  ///< of the machine, mm or degrees, one value per axis; empty if not reported (see $10)
};

struct Line {
  enum class Kind { ok, error, alarm, report, setting, banner, message, noise };
  Kind kind = Kind::noise;
  int number = 0;      ///< of an error, an alarm, a setting
  double value = 0.0;  ///< of a setting; NaN: it is a text, as some of grblHAL's
  Report report{};
  std::optional<Firmware> firmware{};  ///< that a banner, or a line of the reply to "$I", names
};

/// Parses one line without its end. A line that is not understood to the last character is `noise`.
Line parse_line(std::string_view text);

/// What an alarm asks for. The firmwares agree on the numbers up to 9 only.
struct Alarm {
  std::string words{};            ///< with the remedy; the number alone where the firmware does not define it
  bool wants_reset = false;       ///< nothing is read before a reset
  bool switch_not_found = false;  ///< homing did not reach the switch, or not leave it
};
Alarm alarm_of(int number, Firmware firmware);
/// Text of "error:9" with its remedy; the number alone where the firmware does not define it.
std::string error_words(int number, Firmware firmware);
std::string_view name_of(Firmware firmware);
std::string_view name_of(State state);

}  // namespace scanrig::grbl
