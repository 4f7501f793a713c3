#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scanrig::grbl {

// What a GRBL 1.1 controller says [gnea/grbl wiki: Interface, Commands; doc/csv].

enum class State { idle, run, hold, jog, alarm, door, check, home, sleep };

/// A status report, "<Idle|MPos:0.000,0.000,0.000|FS:0,0>".
struct Report {
  State state = State::idle;
  bool underway = false;         ///< a hold or door that is not complete: the axes still move
  std::vector<double> position;  ///< of the machine, mm or degrees, one value an axis; empty if not told (see $10)
};

struct Line {
  enum class Kind { ok, error, alarm, report, setting, banner, message, noise };
  Kind kind = Kind::noise;
  int number = 0;      ///< of an error, an alarm, a setting
  double value = 0.0;  ///< of a setting
  Report report;
};

/// One line without its end. Whatever is not understood to the last character is `noise`.
Line parse_line(std::string_view text);

/// "ALARM:1", "error:9" in words, with what to do; the number alone where it is none of GRBL 1.1.
std::string alarm_words(int number);
std::string error_words(int number);
std::string_view name_of(State state);

}  // namespace scanrig::grbl
