#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig::gpio {

/// Resistor inside the chip; `as_is`: as the board or an earlier program has set it.
enum class Bias { as_is, disabled, pull_up, pull_down };

/// A line by its name, or a line without a name by its chip and its number on that chip.
struct LineSpec {
  std::string name;  ///< the kernel's name, see gpioinfo(1); empty: by chip and offset
  bool active_low = false;
  bool keep = false;  ///< an output that keeps its level when destroyed, as far as its chip allows
  Bias bias = Bias::as_is;
  std::string chip{};   ///< "gpiochip0", or the chip's label, which stays the same at every start
  unsigned offset = 0;  ///< on `chip`

  /// "START", or "gpiochip0:17".
  [[nodiscard]] std::string contact() const { return name.empty() ? chip + ":" + std::to_string(offset) : name; }
};

/// One output line; inactive when made. Inactive when destroyed, too, unless `keep` is set.
/// Threads: one owner.
class Output {
 public:
  virtual ~Output() = default;
  /// Fails with `io`.
  virtual Result<void> set(bool active) = 0;
};

/// Several input lines, in the requested order; true is active. Not debounced.
/// Threads: one owner.
class Inputs {
 public:
  virtual ~Inputs() = default;
  /// Waits, in real time, until the levels differ from `known` or the deadline passes; returns the levels either way.
  /// Fails with `io`.
  virtual Result<std::vector<bool>> wait_change(const std::vector<bool>& known, Deadline deadline) = 0;
};

/// Source of lines.
class Lines {
 public:
  virtual ~Lines() = default;
  /// Fail with `not_found` (no chip has a line of that name, no such chip or offset), `io` (the line is in use, access
  /// is refused, the chip has no such resistor).
  virtual Result<std::unique_ptr<Output>> output(const LineSpec& line) = 0;
  virtual Result<std::unique_ptr<Inputs>> inputs(const std::vector<LineSpec>& lines) = 0;
};

/// The GPIO chips of this machine, through libgpiod 1 or 2.
std::unique_ptr<Lines> chip_lines(Clock& clock);

/// Stand-in for machines without a GPIO chip, for tests: lines behind a Unix socket. README.md lists its commands.
std::unique_ptr<Lines> socket_lines(std::filesystem::path socket, Clock& clock);

}  // namespace scanrig::gpio
