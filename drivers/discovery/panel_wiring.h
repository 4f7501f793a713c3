#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/gpio/lines.h"
#include "drivers/modbus/client.h"

namespace scanrig::discovery {

/// Those of the named lines that exist and can be read. Lines are taken as inputs for a moment, so nothing is switched.
std::vector<std::string> readable_lines(gpio::Lines& lines, const std::vector<std::string>& names);

/// One input of a module that has changed.
struct ChangedInput {
  int channel = 0;
  bool is_set = false;  ///< now
};

/// The inputs and outputs of a Modbus I/O module, while a person finds out what is wired to them.
/// Threads: one owner.
class IoModuleProbe {
 public:
  IoModuleProbe(const modbus::ClientOptions& line, Clock& clock) : client_(line, clock), clock_(clock) {}

  /// Reads how many inputs and outputs it has, at most 64 of each, and how the inputs are at rest. Fails as
  /// modbus::Client.
  Result<void> begin();
  [[nodiscard]] int inputs() const { return static_cast<int>(rest_.size()); }
  [[nodiscard]] int outputs() const { return outputs_; }

  /// Waits until exactly one input differs from its rest; nothing when the deadline passes before. Fails as
  /// modbus::Client, after five missed replies in a row.
  Result<std::optional<ChangedInput>> wait_for_change(Deadline deadline);
  /// Waits until all inputs are as at rest; false when the deadline passes before.
  Result<bool> wait_for_rest(Deadline deadline);
  Result<void> set_output(int channel, bool on);

 private:
  Result<std::vector<bool>> read();
  /// The longest span from address 0 that the module reads.
  Result<int> count(const std::function<Result<std::vector<bool>>(int)>& read);

  modbus::Client client_;
  Clock& clock_;
  std::vector<bool> rest_;
  int outputs_ = 0;
};

}  // namespace scanrig::discovery
