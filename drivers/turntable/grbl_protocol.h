#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scanrig::grbl {

// Output of a GRBL 1.1 controller [gnea/grbl wiki: Interface, Commands; doc/csv].

enum class State { idle, run, hold, jog, alarm, door, check, home, sleep };

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
  double value = 0.0;  ///< of a setting
  Report report;
};

/// Parses one line without its end. A line that is not understood to the last character is `noise`.
Line parse_line(std::string_view text);

/// Text of "ALARM:1" or "error:9" with its remedy; the number alone where GRBL 1.1 does not define it.
std::string alarm_words(int number);
std::string error_words(int number);
std::string_view name_of(State state);

}  // namespace scanrig::grbl
